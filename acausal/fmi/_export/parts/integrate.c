/* Co-simulation: Rodas5P with error control, and a search for events. */
#define SMALLEST 1e-14 /* step relative to the time below which a run fails */
#define MOST_REJECTED 1000
#define MOST_STEPS 1000000 /* between two communication points */

/* The matrix of a step, I / (gamma h) - J, in factors: columns of J without a common row are computed together. */
static int fmu_factorise(Instance *i, double h)
{
    Work *w = &i->work;
    MODEL *m = &i->state.model;
    double direction[N_ALL + 1] = {0.0};
    for (int k = 0; k < N_ALL * N_ALL; k++)
        w->matrix[k] = k % (N_ALL + 1) ? 0.0 : 1.0 / (fmu_gamma * h);
    for (int c = 0; c < N_COLOURS; c++) {
        for (int k = 0; k < N_ALL; k++)
            direction[k] = fmu_colour[k] == c;
        MODEL_along(m, 0.0, direction, w->slopes);
        for (int e = 0; e < N_ENTRIES; e++)
            if (fmu_colour[fmu_column_of[e]] == c)
                w->matrix[N_ALL * fmu_row_of[e] + fmu_column_of[e]] -= w->slopes[fmu_row_of[e]];
    }
    for (int k = 0; k < N_ALL; k++)
        direction[k] = 0.0;
    MODEL_along(m, 1.0, direction, w->by_time);
    for (int k = 0; k < N_ALL; k++) {
        int pivot = k;
        for (int r = k + 1; r < N_ALL; r++)
            if (fabs(w->matrix[N_ALL * r + k]) > fabs(w->matrix[N_ALL * pivot + k]))
                pivot = r;
        w->pivot[k] = pivot;
        if (!(fabs(w->matrix[N_ALL * pivot + k]) > 0.0))
            return 0;
        for (int c = 0; pivot != k && c < N_ALL; c++) {
            const double held = w->matrix[N_ALL * k + c];
            w->matrix[N_ALL * k + c] = w->matrix[N_ALL * pivot + c];
            w->matrix[N_ALL * pivot + c] = held;
        }
        for (int r = k + 1; r < N_ALL; r++) {
            const double factor = w->matrix[N_ALL * r + k] / w->matrix[N_ALL * k + k];
            w->matrix[N_ALL * r + k] = factor;
            for (int c = k + 1; factor != 0.0 && c < N_ALL; c++)
                w->matrix[N_ALL * r + c] -= factor * w->matrix[N_ALL * k + c];
        }
    }
    return 1;
}

static void fmu_solve_step(const Work *w, double *b)
{
    for (int k = 0; k < N_ALL; k++) {
        const double held = b[k];
        b[k] = b[w->pivot[k]];
        b[w->pivot[k]] = held;
    }
    for (int r = 1; r < N_ALL; r++)
        for (int c = 0; c < r; c++)
            b[r] -= w->matrix[N_ALL * r + c] * b[c];
    for (int r = N_ALL - 1; r >= 0; r--) {
        for (int c = r + 1; c < N_ALL; c++)
            b[r] -= w->matrix[N_ALL * r + c] * b[c];
        b[r] /= w->matrix[N_ALL * r + r];
    }
}

/* A step from the time and states of the model: y1, the stages, and the error relative to the tolerance. */
static double fmu_attempt(Instance *i, double t, double h)
{
    Work *w = &i->work;
    MODEL *m = &i->state.model;
    MODEL_rates(m, w->stages[0]);
    if (!fmu_factorise(i, h))
        return INFINITY;
    for (int s = 0; s < STAGES; s++) {
        double *u = w->stages[s];
        for (int k = 0; k < N_ALL; k++) {
            double x = w->y0[k];
            for (int j = 0; j < s; j++)
                x += fmu_stage_a[s][j] * w->stages[j][k];
            m->x[k] = x;
        }
        m->t = t + fmu_stage_time[s] * h;
        MODEL_rates(m, u);
        for (int k = 0; k < N_ALL; k++) {
            double memory = 0.0;
            for (int j = 0; j < s; j++)
                memory += fmu_stage_c[s][j] * w->stages[j][k];
            u[k] += memory / h + h * fmu_stage_slope[s] * w->by_time[k];
        }
        fmu_solve_step(w, u);
    }
    double sum = 0.0;
    for (int k = 0; k < N_ALL; k++) {
        w->y1[k] = m->x[k] + w->stages[STAGES - 1][k];
        const double size = fmax(fabs(w->y0[k]), fabs(w->y1[k]));
        const double error = w->stages[STAGES - 1][k] / (i->tolerance * (fmu_nominal[k] + size));
        sum += error * error;
    }
    const double norm = sqrt(sum / (N_OWN ? N_OWN : 1)); /* inputs have no error */
    return isfinite(norm) ? norm : INFINITY;
}

/* Sets the model to a place in the last step, from 0 to 1. */
static void fmu_go_to(Instance *i, double t, double h, double theta)
{
    const Work *w = &i->work;
    MODEL *m = &i->state.model;
    m->t = t + theta * h;
    for (int k = 0; k < N_ALL; k++) {
        double bend = 0.0;
        for (int p = DENSE - 1; p >= 0; p--) {
            double row = 0.0;
            for (int s = 0; s < STAGES; s++)
                row += fmu_dense[p][s] * w->stages[s][k];
            bend = bend * theta + row;
        }
        m->x[k] = theta < 1.0 ? (1.0 - theta) * w->y0[k] + theta * (w->y1[k] + (1.0 - theta) * bend) : w->y1[k];
    }
    i->state.is_evaluated = 0;
}

/* How far the first relation to change since the last event has changed: positive if one has. */
static double fmu_change(Instance *i)
{
    double most = -INFINITY;
#ifdef HAS_EVENTS
    double z[N_INDICATORS + 1] = {0.0};
    fmu_indicators(i, z);
    for (int k = 0; k < N_INDICATORS; k++)
        most = fmax(most, i->state.model.truths[k] ? -z[k] : z[k]);
#else
    (void)i;
#endif
    return most;
}

/* Goes to just after the first change of a relation within the last step, by secants (Illinois) and bisection. The
   changes at the start and at the end of the step are given. */
static void fmu_locate(Instance *i, double t, double h, double at_start, double at_end)
{
    const double close = fmax(4e-16 * fabs(t) / h, 1e-15);
    double low = 0.0, high = 1.0, width = 1.0;
    for (int tries = 0; high - low > 2.0 * close; tries++) {
        double middle = isfinite(at_start) ? low - at_start * (high - low) / (at_end - at_start) : 0.5 * (low + high);
        if (tries % 3 == 2) {
            if (high - low > 0.5 * width)
                middle = 0.5 * (low + high);
            width = high - low;
        }
        middle = fmin(fmax(middle, low + close), high - close);
        fmu_go_to(i, t, h, middle);
        const double here = fmu_change(i);
        if (here > 0.0) {
            high = middle;
            at_end = here;
            at_start *= 0.5;
        } else {
            low = middle;
            at_start = here;
            at_end *= 0.5;
        }
    }
    fmu_go_to(i, t, h, high);
}

/* One step, at most to the time `to`: it ends where a relation changes. Returns 0 if there is no step. */
static int fmu_take_step(Instance *i, double to)
{
    MODEL *m = &i->state.model;
    const double t = m->t, room = to - t;
    const double before = fmu_change(i);
    double h = i->state.size > 0.0 ? i->state.size : 1e-4 * room;
    memcpy(i->work.y0, m->x, N_ALL * sizeof(double));
    for (int tries = 0; tries < MOST_REJECTED; tries++) {
        h = fmin(h, room);
        m->t = t;
        memcpy(m->x, i->work.y0, N_ALL * sizeof(double));
        const double error = fmu_attempt(i, t, h);
        const double factor = fmin(5.0, fmax(0.2, 0.9 * pow(fmax(error, 1e-10), -0.2)));
        if (error <= 1.0) {
            i->state.size = h < room || factor < 1.0 ? factor * h : fmax(i->state.size, h);
            fmu_go_to(i, t, h, 1.0);
            m->t = h < room ? m->t : to;
            const double change = fmu_change(i);
            if (change > 0.0) {
                fmu_locate(i, t, h, before, change);
                i->work.has_event = 1;
            }
            remember(m);
            return 1;
        }
        h *= factor;
        if (!(h > SMALLEST * fmax(fabs(t), 1e-3)))
            break;
    }
    return fmu_report(i, "The step size of co-simulation has become too small.");
}

/* Integrate to a time, with all events. Returns 1, 0 for a failure, or -1 if an event ends the run. */
static int fmu_advance(Instance *i, double to)
{
    MODEL *m = &i->state.model;
    for (long steps = 0; m->t < to; steps++) {
        if (steps == MOST_STEPS)
            return fmu_report(i, "Co-simulation takes too many steps between two communication points.");
        const double due = fmu_next_event(i), end = fmin(to, due);
        i->work.has_event = 0;
        if (end > m->t && !fmu_take_step(i, end))
            return 0;
        if (i->work.has_event || m->t >= due)
            if (fmu_do_events(i) < 0)
                return -1;
    }
    return 1;
}

/* A communication step. Returns 1, 0 for an error, or -1 if an event ends the run. */
static int fmu_step(Instance *i, double time, double step)
{
    if (!fmu_is_allowed(i, BETWEEN_STEPS, "DoStep"))
        return 0;
    if (!(step > 0.0) || !isfinite(step))
        return fmu_report(i, "The length of a step must be positive and finite.");
    if (!fmu_is_same_time(time, i->state.model.t, step))
        return fmu_report(i, "A step must start at the end of the last one.");
    if (time + step > i->state.stop && !fmu_is_same_time(time + step, i->state.stop, step))
        return fmu_report(i, "A step must not go beyond the stop time.");
    if (!fmu_is_admissible(i))
        return 0;
    const int result = fmu_advance(i, time + step);
    fmu_enter(i, result > 0 ? BETWEEN_STEPS : result < 0 ? DISCARDED : FAILED);
    i->work.has_ended = result < 0;
    return result;
}
