/* The change dx of a root of the equations, whose residuals change by dx at constant x. */
static void move_root(Equations equations, const double *in, const double *x, double *dx, int n)
{
    double slopes[MAX_UNKNOWNS * MAX_UNKNOWNS], residual[MAX_UNKNOWNS];
    equations(in, x, residual, slopes);
    const int is_regular = eliminate(slopes, dx, n);
    for (int i = 0; i < n; i++)
        dx[i] = is_regular ? -dx[i] : NAN;
}
