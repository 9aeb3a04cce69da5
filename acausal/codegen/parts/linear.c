/* The unknowns x of a linear block; NaN if its equations are singular. */
static void solve_linear(Equations equations, const double *in, double *x, int n)
{
    double slopes[MAX_UNKNOWNS * MAX_UNKNOWNS], residual[MAX_UNKNOWNS];
    for (int i = 0; i < n; i++)
        x[i] = 0.0;
    equations(in, x, residual, slopes);
    const int is_regular = eliminate(slopes, residual, n);
    for (int i = 0; i < n; i++)
        x[i] = is_regular ? -residual[i] : NAN;
}
