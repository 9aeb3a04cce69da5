#define FOLLOWED 50 /* maximum number of steps onto constraints */
#define EXACT 1e-14 /* target and accepted violation of a constraint, relative to its size */
#define ACCEPTED 1e-9

/* Moves y to the nearest point at which m constraints hold; an element with a small root of its weight moves less.
   Returns 0 if there is none. */
static int project(Equations constraints, const double *in, double *y, const double *size, const double *root, int n,
                   int m)
{
    double missing[MAX_TIED], slopes[MAX_TIED * MAX_TIED], square[MAX_TIED * MAX_TIED], violation = INFINITY;
    for (int count = 0; count < FOLLOWED; count++) {
        constraints(in, y, missing, slopes);
        violation = 0.0;
        for (int i = 0; i < m; i++) {
            double row = 0.0;
            for (int j = 0; j < n; j++)
                row += fabs(slopes[n * i + j] * size[j]);
            row = row > 0.0 ? row : 1.0;
            missing[i] /= row;
            violation = fabs(missing[i]) <= violation ? violation : fabs(missing[i]);
            for (int j = 0; j < n; j++)
                slopes[n * i + j] *= root[j] * size[j] / row;
        }
        if (violation <= EXACT)
            return 1;
        for (int i = 0; i < m; i++)
            for (int k = 0; k < m; k++) {
                square[m * i + k] = 0.0;
                for (int j = 0; j < n; j++)
                    square[m * i + k] += slopes[n * i + j] * slopes[n * k + j];
            }
        if (!eliminate(square, missing, m))
            return 0;
        for (int j = 0; j < n; j++)
            for (int i = 0; i < m; i++)
                y[j] -= size[j] * root[j] * slopes[n * i + j] * missing[i];
    }
    return violation <= ACCEPTED;
}
