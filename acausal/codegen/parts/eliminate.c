/* A system of linear equations by elimination with partial pivoting; its rows are scaled by their largest element.
   The solution replaces b. Returns 0 if the matrix is singular. */
static int eliminate(double *a, double *b, int n)
{
    for (int i = 0; i < n; i++) {
        double largest = 0.0;
        for (int j = 0; j < n; j++)
            largest = fabs(a[n * i + j]) > largest ? fabs(a[n * i + j]) : largest;
        if (!(largest > 0.0))
            return 0;
        for (int j = 0; j < n; j++)
            a[n * i + j] /= largest;
        b[i] /= largest;
    }
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[n * i + k]) > fabs(a[n * pivot + k]))
                pivot = i;
        if (!(fabs(a[n * pivot + k]) > 0.0))
            return 0;
        for (int j = k; pivot != k && j < n; j++) {
            const double held = a[n * k + j];
            a[n * k + j] = a[n * pivot + j];
            a[n * pivot + j] = held;
        }
        const double held = b[k];
        b[k] = b[pivot];
        b[pivot] = held;
        for (int i = k + 1; i < n; i++) {
            const double factor = a[n * i + k] / a[n * k + k];
            if (factor == 0.0)
                continue;
            for (int j = k + 1; j < n; j++)
                a[n * i + j] -= factor * a[n * k + j];
            b[i] -= factor * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            b[k] -= a[n * k + j] * b[j];
        b[k] /= a[n * k + k];
    }
    return 1;
}
