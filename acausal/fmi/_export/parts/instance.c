/* The states of FMI's state machine. */
enum {
    INSTANTIATED = 1,
    INITIALISING = 2,
    AT_EVENT = 4,
    CONTINUOUS = 8,
    BETWEEN_STEPS = 16,
    DISCARDED = 32, /* after a step that ended before its communication point */
    TERMINATED = 64,
    FAILED = 128,
    EVALUATED = INITIALISING | AT_EVENT | CONTINUOUS | BETWEEN_STEPS | DISCARDED | TERMINATED
};

/* An instance of the model: its state, which is copied as a whole, and what belongs to the importer. */
typedef struct {
    MODEL model;
    int mode;    /* of the state machine */
    double stop; /* the end of the experiment */
    double size; /* of the next step of co-simulation, s; 0 before the first */
    int has_begun;    /* whether the events at the start have happened */
    int is_evaluated; /* whether the values belong to the time, the states and the parameters */
} State;

/* Numbers of one step. */
typedef struct {
    double y0[N_ALL + 1], y1[N_ALL + 1], slopes[N_ALL + 1], by_time[N_ALL + 1], stages[STAGES][N_ALL + 1];
    double matrix[N_ALL * N_ALL + 1];
    int pivot[N_ALL + 1];
    double z_along[N_INDICATORS + 1]; /* derivatives of the event indicators along a direction */
    int has_event;                    /* whether it ended at a change of a relation */
    int has_ended;                    /* whether an event ended the run */
} Work;

typedef struct Instance Instance;
struct Instance {
    State state;
    int is_co_simulation;
    double tolerance;
    void (*log)(Instance *, const char *); /* passes an error to the importer */
    void *environment, *logger;
    char name[256];
    Work work;
};

static void fmu_begin(Instance *i)
{
    memset(&i->state, 0, sizeof(State));
    MODEL_start(&i->state.model);
    i->state.mode = INSTANTIATED;
    i->state.stop = INFINITY;
    i->tolerance = 1e-6;
}

static void fmu_evaluate(Instance *i)
{
    if (!i->state.is_evaluated)
        MODEL_evaluate(&i->state.model);
    i->state.is_evaluated = 1;
}

/* The event indicators: relations of the model, shifted by a band, so that an importer that stops just after a sign
   change finds the relation changed. */
static void fmu_indicators(Instance *i, double *z)
{
    (void)z;
#ifdef HAS_EVENTS
    MODEL *m = &i->state.model;
    fmu_evaluate(i);
    MODEL_indicators(m, z);
    for (int k = 0; k < N_INDICATORS; k++)
        z[k] += m->truths[k] ? band[k] : -band[k];
#else
    (void)i;
#endif
}

static double fmu_indicator_of(Instance *i, int place)
{
    double z[N_INDICATORS + 1] = {0.0};
    fmu_indicators(i, z);
    return z[place];
}

static int fmu_report(Instance *i, const char *text)
{
    if (i->log && text)
        i->log(i, text);
    return 0;
}

/* Whether a function may be called in the present mode. */
static int fmu_is_allowed(Instance *i, int modes, const char *function)
{
    if (!i)
        return 0;
    if (i->state.mode & modes)
        return 1;
    const char *mode = i->state.mode == INSTANTIATED    ? "after instantiation"
                       : i->state.mode == INITIALISING  ? "in initialisation"
                       : i->state.mode == AT_EVENT      ? "at an event"
                       : i->state.mode == CONTINUOUS    ? "in continuous time"
                       : i->state.mode == BETWEEN_STEPS ? "between the steps of co-simulation"
                       : i->state.mode == DISCARDED     ? "after a step that ended early"
                       : i->state.mode == TERMINATED    ? "after termination"
                                                        : "after an error";
    char text[160] = "";
    snprintf(text, sizeof(text), "%s cannot be called %s.", function, mode);
    return fmu_report(i, text);
}

/* Whether a function of model exchange may be called in the present mode. */
static int fmu_is_exchange(Instance *i, int modes, const char *function)
{
    if (!fmu_is_allowed(i, modes, function))
        return 0;
    return !i->is_co_simulation || fmu_report(i, "Co-simulation has no functions of model exchange.");
}

/* Whether an array of the importer exists, and has the size that it must have. */
static int fmu_is_array(Instance *i, const void *array, size_t n, size_t wanted)
{
    return (n == wanted && (array || !n)) || fmu_report(i, "An array is missing or has another size.");
}

/* Enters a mode of the state machine. Returns 1. */
static int fmu_enter(Instance *i, int mode)
{
    i->state.mode = mode;
    return 1;
}

/* The value of a variable. Returns 0 if there is no such variable. */
static int fmu_get_value(Instance *i, unsigned int reference, double *value)
{
    MODEL *m = &i->state.model;
    if (reference >= N_VARIABLES)
        return 0;
    const int place = fmu_place_of[reference];
    switch (fmu_space_of[reference]) {
    case 't': *value = m->t; break;
    case 'x': *value = m->x[place]; break;
    case 'p': *value = m->p[place]; break;
    case 'd': *value = m->d[place]; break;
    case 'v': fmu_evaluate(i); *value = m->v[place]; break;
    case 'z': *value = fmu_indicator_of(i, place); break;
    default: *value = 0.0;
    }
    *value *= fmu_sign_of[reference];
    return 1;
}

/* Sets an input, a state or a parameter. Returns 0 for any other variable, and for one that is fixed at present. */
static int fmu_set_value(Instance *i, unsigned int reference, double value)
{
    MODEL *m = &i->state.model;
    const int mode = i->state.mode;
    const int needed = mode & (INSTANTIATED | INITIALISING) ? 1 : mode == CONTINUOUS ? 3 : 2;
    if (reference >= N_VARIABLES || fmu_settable[reference] < needed || !isfinite(value))
        return 0;
    double *target = fmu_space_of[reference] == 'x' ? m->x : fmu_space_of[reference] == 'p' ? m->p : m->d;
    target[fmu_place_of[reference]] = value;
    i->state.is_evaluated = 0;
    return 1;
}

/* The events at the present time. Returns 1 if they changed states or discrete variables, 0 if not, -1 if they end the
   run. */
static int fmu_do_events(Instance *i)
{
#ifdef HAS_EVENTS
    MODEL *m = &i->state.model;
    const int is_first = !i->state.has_begun;
    i->state.has_begun = 1;
    const int changed = is_first ? MODEL_initialise(m) : MODEL_events(m);
    i->state.is_evaluated = 0;
    if (changed < 0)
        fmu_report(i, m->refused ? m->refused : "The events at an instant have no end.");
    return changed;
#else
    i->state.has_begun = 1;
    return 0;
#endif
}

static double fmu_next_event(const Instance *i)
{
#ifdef HAS_EVENTS
    return MODEL_next_time(&i->state.model);
#else
    (void)i;
    return INFINITY;
#endif
}

/* The rates of the states of the FMU. Returns 0 if one of them is not finite. */
static int fmu_rates_of(Instance *i, double *rates)
{
    int is_finite = 1;
    fmu_evaluate(i);
    for (int k = 0; k < N_OWN; k++) {
        rates[k] = i->state.model.v[fmu_rate_place[k]];
        is_finite = is_finite && isfinite(rates[k]);
    }
    return is_finite;
}

/* Writes the derivatives along a direction of states, inputs and the time: of all values to dv, and of the event
   indicators. */
static void fmu_along(Instance *i, double dt, const double *dx)
{
    fmu_evaluate(i);
    MODEL_along_all(&i->state.model, dt, dx);
#ifdef HAS_EVENTS
    MODEL_indicators_along(&i->state.model, dt, i->work.z_along);
#endif
}

/* The derivative of a variable along the last direction; dt and dx are that direction. */
static double fmu_derivative_of(Instance *i, unsigned int reference, double dt, const double *dx)
{
    const int place = fmu_place_of[reference];
    double value = 0.0;
    switch (fmu_space_of[reference]) {
    case 't': value = dt; break;
    case 'x': value = dx[place]; break;
    case 'v': value = i->state.model.dv[place]; break;
    case 'z': value = i->work.z_along[place]; break;
    }
    return fmu_sign_of[reference] * value;
}

/* Derivatives of variables along the direction in which the known ones change by the seeds. Returns 0 for a known
   variable that is no state, input or the time, and for an unknown one that does not exist. */
static int fmu_directional(Instance *i, const unsigned int *unknowns, size_t n_unknowns, const unsigned int *knowns,
                       size_t n_knowns, const double *seeds, double *found)
{
    double dt = 0.0, dx[N_ALL + 1] = {0.0};
    for (size_t k = 0; k < n_knowns; k++) {
        if (knowns[k] >= N_VARIABLES || (fmu_space_of[knowns[k]] != 'x' && fmu_space_of[knowns[k]] != 't'))
            return fmu_report(i, "Derivatives are with respect to states, inputs and the time.");
        if (fmu_space_of[knowns[k]] == 't')
            dt += seeds[k];
        else
            dx[fmu_place_of[knowns[k]]] += fmu_sign_of[knowns[k]] * seeds[k];
    }
    fmu_along(i, dt, dx);
    for (size_t k = 0; k < n_unknowns; k++) {
        if (unknowns[k] >= N_VARIABLES)
            return fmu_report(i, "A derivative is asked of a variable that does not exist.");
        found[k] = fmu_derivative_of(i, unknowns[k], dt, dx);
    }
    return 1;
}

static Instance *fmu_new_instance(const char *name, const char *token, const char *own_token)
{
    if (!token || strcmp(token, own_token))
        return 0;
    Instance *i = calloc(1, sizeof(Instance));
    if (!i)
        return 0;
    strncpy(i->name, name ? name : "", sizeof(i->name) - 1);
    fmu_begin(i);
    return i;
}

/* Whether the requirements on parameters hold. Importers set parameters one by one, also at events and between steps,
   so this is asked before the time goes on. */
static int fmu_is_admissible(Instance *i)
{
    const char *violation = MODEL_violation(&i->state.model);
    return !violation || fmu_report(i, violation);
}

/* The start of initialisation. The tolerance is 0 and the stop time infinite if the importer gives none. */
static int fmu_begin_initialisation(Instance *i, double start, double tolerance, double stop)
{
    if (!isfinite(start) || !(tolerance >= 0.0) || !(stop >= start))
        return fmu_report(i, "The start time must be finite, the tolerance positive and the stop time not before the start.");
    if (tolerance > 0.0)
        i->tolerance = tolerance;
    i->state.model.t = i->state.model.start = start;
    i->state.stop = stop;
    i->state.is_evaluated = 0;
    return 1;
}

/* Whether times are equal up to the rounding errors of an importer that multiplies or adds steps of this length. */
static int fmu_is_same_time(double a, double b, double step)
{
    return fabs(a - b) <= 1e-6 * step + 1e-12 * fmax(fabs(a), fabs(b));
}

static void fmu_set_time(Instance *i, double time)
{
    i->state.model.t = time;
    i->state.is_evaluated = 0;
}

static void fmu_set_states(Instance *i, const double *states)
{
    for (int k = 0; k < N_OWN; k++)
        i->state.model.x[fmu_own_state[k]] = states[k];
    i->state.is_evaluated = 0;
}

static void fmu_get_states(const Instance *i, double *states)
{
    for (int k = 0; k < N_OWN; k++)
        states[k] = i->state.model.x[fmu_own_state[k]];
}

/* The solutions of nonlinear equations become the guesses of the next step. */
static void fmu_end_step(Instance *i)
{
    fmu_evaluate(i);
    remember(&i->state.model);
}

/* Copies the state; allocates the copy if there is none. */
static int fmu_copy_state(const Instance *i, void **copy)
{
    if (!copy)
        return 0;
    if (!*copy)
        *copy = malloc(sizeof(State));
    if (!*copy)
        return 0;
    memcpy(*copy, &i->state, sizeof(State));
    return 1;
}

static int fmu_restore_state(Instance *i, const void *copy)
{
    if (!copy)
        return 0;
    memcpy(&i->state, copy, sizeof(State));
#ifdef HAS_EVENTS
    i->state.model.refused = 0; /* the pointer may come from another process */
#endif
    return 1;
}
