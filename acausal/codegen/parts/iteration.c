#define TOGETHER 10 /* rounds in which all triggered events act together; in later rounds, one at a time */
#define ROUNDS (TOGETHER + 4 * N_EVENTS + 16)

/* Marks the events whose conditions have become true, and those of either direction that have become false. A relation
   keeps its truth while its indicator is within its band. Returns their number. */
static int find_triggered(MODEL *m, int *fired, int only_first)
{
    int holds[N_EVENTS], count = 0;
    double indicator[N_RELATIONS];
    MODEL_indicators(m, indicator);
    for (int k = 0; k < N_RELATIONS; k++)
        if (fabs(indicator[k]) > band[k] || m->is_start)
            m->truths[k] = indicator[k] > 0.0;
    m->is_start = 0;
    conditions(m->truths, holds);
    for (int e = 0; e < N_EVENTS; e++) {
        fired[e] = is_either[e] ? holds[e] != m->holds[e] : holds[e] && !m->holds[e];
        fired[e] = fired[e] && !(only_first && count);
        count += fired[e];
        if (is_either[e])
            m->holds[e] = fired[e] ? holds[e] : m->holds[e];
        else
            m->holds[e] = holds[e] && (m->holds[e] || fired[e]);
    }
    return count;
}

/* Executes the events at the time of the struct, and those that they trigger: first the time events that are due, then
   the events whose conditions change, in rounds, and last the clocks. Afterwards, all values are evaluated.
   Returns 1 if an event has changed the model, 0 if not, and -1 if the events do not end, contradict
   constraints, or one of them is refused. */
int MODEL_events(MODEL *m)
{
    int fired[N_EVENTS], has_happened[N_EVENTS] = {0}, n_happened = 0, is_changed = 0;
    int count = take_due(m, fired, 0);
    for (int round = 0; round < ROUNDS; round++) {
        MODEL_evaluate(m);
        if (!count)
            count = find_triggered(m, fired, round >= TOGETHER + n_happened);
        if (!count)
            count = take_due(m, fired, 0);
        if (!count)
            count = take_due(m, fired, 1);
        if (!count)
            return is_changed;
        for (int e = 0; e < N_EVENTS; e++) {
            n_happened += fired[e] && !has_happened[e];
            has_happened[e] = has_happened[e] || fired[e];
            if (fired[e] && is_refused[e]) {
                m->refused = refusals[e];
                return -1;
            }
        }
        if (!act(m, fired))
            return -1;
        schedule_changes(m);
        is_changed = 1;
        count = 0;
    }
    return -1;
}

/* The start: time events of the past, and the events whose conditions hold. Returns as MODEL_events does. */
int MODEL_initialise(MODEL *m)
{
    for (int e = 0; e < N_EVENTS; e++)
        m->holds[e] = 0;
    m->is_start = 1;
    return execute_past(m) ? MODEL_events(m) : -1;
}
