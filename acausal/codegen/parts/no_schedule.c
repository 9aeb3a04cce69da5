/* There are no time events. */
static int take_due(MODEL *m, int *fired, int of_clocks)
{
    (void)m, (void)of_clocks;
    for (int e = 0; e < N_EVENTS; e++)
        fired[e] = 0;
    return 0;
}

static void schedule_changes(MODEL *m)
{
    (void)m;
}

static int execute_past(MODEL *m)
{
    (void)m;
    return 1;
}

double MODEL_next_time(const MODEL *m)
{
    (void)m;
    return INFINITY;
}
