/* The first time later than t of a time event that repeats, unless `every` is infinite. */
static double next_time(double first, double every, double t)
{
    if (first > t || !isfinite(every))
        return first > t ? first : INFINITY;
    double turn = floor((t - first) / every);
    while (first + turn * every <= t)
        turn += 1.0;
    return first + turn * every;
}

/* The last time of it that is not later than t; infinite if there is none. */
static double last_time(double first, double every, double t)
{
    if (first > t)
        return INFINITY;
    return isfinite(every) ? first + floor((t - first) / every) * every : first;
}

/* Sets the next times of the time events after t: of all of them, or of those whose times have changed. */
static void schedule(MODEL *m, double t, int only_changed)
{
    double first[N_TIMES], every[N_TIMES];
    int is_changed[N_EVENTS] = {0};
    times(m, first, every);
    for (int i = 0; i < N_TIMES; i++) {
        if (!only_changed || first[i] != m->first[i] || every[i] != m->every[i])
            is_changed[event_of_time[i]] = 1;
        m->first[i] = first[i];
        m->every[i] = every[i];
    }
    for (int e = 0; e < N_EVENTS; e++)
        m->due[e] = is_changed[e] ? INFINITY : m->due[e];
    for (int i = 0; i < N_TIMES; i++) {
        const int e = event_of_time[i];
        if (is_changed[e])
            m->due[e] = fmin(m->due[e], next_time(first[i], every[i], t));
    }
}

/* Marks the time events that are due, clocks or others, and sets their next times. Returns their number. */
static int take_due(MODEL *m, int *fired, int of_clocks)
{
    const double now = m->t + ROUNDING * fabs(m->t);
    int count = 0;
    for (int e = 0; e < N_EVENTS; e++) {
        fired[e] = m->due[e] <= now && is_clock[e] == of_clocks;
        count += fired[e];
        m->due[e] = fired[e] ? INFINITY : m->due[e];
    }
    for (int i = 0; i < N_TIMES && count; i++) {
        const int e = event_of_time[i];
        if (fired[e])
            m->due[e] = fmin(m->due[e], next_time(m->first[i], m->every[i], now));
    }
    return count;
}

/* Sets the next times of the time events whose times have changed, which may be now. */
static void schedule_changes(MODEL *m)
{
    schedule(m, nextafter(m->t - ROUNDING * fabs(m->t), -INFINITY), 1); /* earlier than now, also at 0 */
}

/* Executes the time events of the past in their order. Clocks that are due at the start wait. Returns 0 if an event
   contradicts constraints. */
static int execute_past(MODEL *m)
{
    const double slack = ROUNDING * fabs(m->t);
    double last[N_EVENTS];
    int fired[N_EVENTS];
    for (int e = 0; e < N_EVENTS; e++)
        m->due[e] = last[e] = INFINITY;
    schedule(m, m->t + slack, 0);
    for (int i = 0; i < N_TIMES; i++) {
        const int e = event_of_time[i];
        const double own = last_time(m->first[i], m->every[i], m->t + slack);
        last[e] = !isfinite(last[e]) || own > last[e] ? own : last[e];
    }
    for (int e = 0; e < N_EVENTS; e++)
        if (is_clock[e] && isfinite(last[e]) && last[e] >= m->t - slack) {
            m->due[e] = m->t;
            last[e] = INFINITY;
        }
    for (;;) {
        double earliest = INFINITY;
        for (int e = 0; e < N_EVENTS; e++)
            earliest = fmin(earliest, last[e]);
        if (!isfinite(earliest))
            return 1;
        for (int e = 0; e < N_EVENTS; e++) {
            fired[e] = last[e] <= earliest + ROUNDING * fabs(earliest);
            last[e] = fired[e] ? INFINITY : last[e];
        }
        MODEL_evaluate(m);
        if (!act(m, fired))
            return 0;
        schedule_changes(m);
    }
}

double MODEL_next_time(const MODEL *m)
{
    double next = INFINITY;
    for (int e = 0; e < N_EVENTS; e++)
        next = fmin(next, m->due[e]);
    return next;
}
