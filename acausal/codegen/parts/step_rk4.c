/* One step of the classical Runge-Kutta method of order 4. */
static int integrate(MODEL *m)
{
    static const double at[4] = {0.0, 0.5 * STEP, 0.5 * STEP, STEP};
    static const double weight[4] = {STEP / 6.0, STEP / 3.0, STEP / 3.0, STEP / 6.0};
    double start[N_STATES], rates[N_STATES], sum[N_STATES] = {0.0};
    const double t = m->t;
    for (int i = 0; i < N_STATES; i++) {
        start[i] = m->x[i];
        rates[i] = 0.0;
    }
    for (int stage = 0; stage < 4; stage++) {
        m->t = t + at[stage];
        for (int i = 0; i < N_STATES; i++)
            m->x[i] = start[i] + at[stage] * rates[i];
        MODEL_rates(m, rates);
        if (!stage)
            remember(m);
        for (int i = 0; i < N_STATES; i++)
            sum[i] += weight[stage] * rates[i];
    }
    m->t = t;
    for (int i = 0; i < N_STATES; i++)
        m->x[i] = start[i] + sum[i];
    return 1;
}
