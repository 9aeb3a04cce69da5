/* One step of the explicit Euler method. */
static int integrate(MODEL *m)
{
    double rates[N_STATES];
    MODEL_rates(m, rates);
    remember(m);
    for (int i = 0; i < N_STATES; i++)
        m->x[i] += STEP * rates[i];
    return 1;
}
