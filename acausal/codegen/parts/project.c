#define FOLLOWED 100 /* maximum number of steps onto constraints */
#define NEAR 1e-5 /* steps, relative to nominal sizes, after which only the constraints are improved */
#define EXACT 1e-14 /* target and accepted violation of a constraint, relative to its size */
#define ACCEPTED 1e-9

/* Moves y to the nearest point at which m constraints hold: repeatedly, towards the point nearest to the start at which
   the constraints hold that are linearised at the last point. Steps that become longer are halved. An element with a
   small root of its weight moves less. Returns 0 if there is no such point. */
static int project(Equations constraints, const double *in, double *y, const double *size, const double *root, int n,
                   int m)
{
    double missing[MAX_TIED], slopes[MAX_TIED * MAX_TIED], square[MAX_TIED * MAX_TIED], start[MAX_TIED];
    double violation = INFINITY, moved = INFINITY, share = 1.0;
    int is_near = 0;
    for (int j = 0; j < n; j++)
        start[j] = y[j];
    for (int count = 0; count < FOLLOWED; count++) {
        const double before = moved;
        constraints(in, y, missing, slopes);
        violation = moved = 0.0;
        for (int i = 0; i < m; i++) {
            double row = 0.0;
            for (int j = 0; j < n; j++)
                row += fabs(slopes[n * i + j] * size[j]);
            row = row > 0.0 ? row : 1.0;
            violation = fabs(missing[i] / row) <= violation ? violation : fabs(missing[i] / row);
            for (int j = 0; j < n && !is_near; j++)
                missing[i] += slopes[n * i + j] * (start[j] - y[j]);
            missing[i] /= row;
            for (int j = 0; j < n; j++)
                slopes[n * i + j] *= root[j] * size[j] / row;
        }
        if (violation <= EXACT && (is_near || count == 0))
            return 1;
        for (int i = 0; i < m; i++)
            for (int k = 0; k < m; k++) {
                square[m * i + k] = 0.0;
                for (int j = 0; j < n; j++)
                    square[m * i + k] += slopes[n * i + j] * slopes[n * k + j];
            }
        if (!eliminate(square, missing, m))
            return 0;
        for (int pass = 0; pass < 2; pass++) { /* the length of the step, then the step */
            for (int j = 0; j < n; j++) {
                double change = is_near ? 0.0 : start[j] - y[j];
                for (int i = 0; i < m; i++)
                    change -= size[j] * root[j] * slopes[n * i + j] * missing[i];
                moved = pass || fabs(change) / size[j] <= moved ? moved : fabs(change) / size[j];
                y[j] += pass ? share * change : 0.0;
            }
            share = is_near ? 1.0 : pass || moved < before ? share : 0.5 * share;
        }
        is_near = is_near || moved <= NEAR;
    }
    return violation <= ACCEPTED;
}
