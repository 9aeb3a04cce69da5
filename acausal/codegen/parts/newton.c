#define ITERATIONS 200
#define CLOSE 1e-9 /* last step of Newton's method that leaves an error near rounding */

static void copy(double *to, const double *from, int n)
{
    for (int i = 0; i < n; i++)
        to[i] = from[i];
}

static double length(const double *a, int n)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += a[i] * a[i];
    return sqrt(sum);
}

/* A root by Newton's method from x. A step is shortened until the next simplified step, with the same derivatives, is
   shorter than it (the natural monotonicity test). Returns 0 if it does not converge. */
static int newton(Equations equations, const double *in, double *x, int n)
{
    double trial[MAX_UNKNOWNS], step[MAX_UNKNOWNS] = {0.0}, next[MAX_UNKNOWNS], simplified[MAX_UNKNOWNS];
    double slopes[MAX_UNKNOWNS * MAX_UNKNOWNS], here[MAX_UNKNOWNS * MAX_UNKNOWNS];
    double work[MAX_UNKNOWNS * MAX_UNKNOWNS], share = 1.0;
    for (int tried = 0; tried < ITERATIONS; tried++) {
        int is_root = 1;
        for (int i = 0; i < n; i++)
            trial[i] = tried ? x[i] - share * step[i] : x[i];
        equations(in, trial, next, here);
        if (tried) {
            copy(work, slopes, n * n);
            copy(simplified, next, n);
            eliminate(work, simplified, n);
            if (!(length(simplified, n) <= (1.0 - 0.25 * share) * length(step, n))) {
                share *= 0.5;
                continue;
            }
            share = share < 0.25 ? 4.0 * share : 1.0;
        }
        copy(slopes, here, n * n);
        copy(x, trial, n);
        if (!eliminate(here, next, n))
            return 0;
        copy(step, next, n);
        for (int i = 0; i < n; i++) {
            if (!isfinite(step[i]))
                return 0;
            is_root = is_root && fabs(step[i]) <= CLOSE * (1.0 + fabs(x[i]));
        }
        if (is_root) {
            for (int i = 0; i < n; i++)
                x[i] -= step[i];
            return 1;
        }
    }
    return 0;
}

/* The scaled unknowns x of a nonlinear block: from the last values, otherwise from the start values. NaN and 0 if
   neither leads to a root. */
static int solve(Equations equations, const double *in, double *x, int n, const double *sizes, const double *last,
                 const double *first)
{
    for (int attempt = 0; attempt < 2; attempt++) {
        for (int i = 0; i < n; i++)
            x[i] = (attempt ? first : last)[i] / sizes[i];
        if (newton(equations, in, x, n))
            return 1;
    }
    for (int i = 0; i < n; i++)
        x[i] = NAN;
    return 0;
}
