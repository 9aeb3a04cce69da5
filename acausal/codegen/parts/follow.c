/* All tied variables after those that `is_set` have new values. The constraints may be nonlinear, so that the first
   projection moves the new values. They are restored, and the second projection, which starts close to a solution,
   keeps them. Returns 0 if the constraints forbid the new values. */
static int follow(const MODEL *m, double *z, const int *is_set)
{
    double aim[N_TIED];
    for (int i = 0; i < N_TIED; i++)
        aim[i] = z[i];
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < N_TIED; i++)
            z[i] = is_set[i] ? aim[i] : z[i];
        if (!onto_constraints(m, z, is_set))
            return 0;
    }
    for (int i = 0; i < N_TIED; i++)
        if (is_set[i] && !(fabs(z[i] - aim[i]) <= TOLERANCE * (size_of_tied[i] + fabs(aim[i]))))
            return 0;
    return 1;
}
