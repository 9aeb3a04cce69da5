/* The functions of FMI 2.0. */
enum { MODEL_EXCHANGE, CO_SIMULATION };
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);

typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef struct {
    int again, ends, nominals, states, has_next;
    double next;
} EventInfo;

static void fmu_log_error(Instance *i, const char *text)
{
    ((Logger)i->logger)(i->environment, i->name, ERROR, "error", "%s", text);
}

EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

EXPORT int fmi2SetDebugLogging(void *instance, int on, size_t n, const char *const categories[])
{
    (void)instance, (void)on, (void)n, (void)categories;
    return OK;
}

EXPORT void *fmi2Instantiate(const char *name, int type, const char *token, const char *resources,
                             const Callbacks *callbacks, int visible, int logging)
{
    Instance *i = fmu_new_instance(name, token, TOKEN);
    const Logger logger = callbacks ? callbacks->logger : 0;
    (void)resources, (void)visible, (void)logging;
    if (!i) {
        if (logger)
            logger(callbacks->environment, name, ERROR, "error", "The GUID is not that of this FMU.");
        return 0;
    }
    i->is_co_simulation = type == CO_SIMULATION;
    i->environment = callbacks ? callbacks->environment : 0;
    i->logger = (void *)logger;
    i->log = logger ? fmu_log_error : 0;
    return i;
}

EXPORT int fmi2SetupExperiment(void *instance, int has_tolerance, double tolerance, double start, int has_stop,
                               double stop)
{
    if (!fmu_is_allowed(instance, INSTANTIATED, "SetupExperiment"))
        return ERROR;
    return fmu_status(
        fmu_begin_initialisation(instance, start, has_tolerance ? tolerance : 0.0, has_stop ? stop : INFINITY));
}

MODE(EnterInitializationMode, INSTANTIATED, INITIALISING)

/* Variables: all are real numbers. */

EXPORT int fmi2GetReal(void *instance, const Reference references[], size_t n, double values[])
{
    if (!fmu_is_allowed(instance, EVALUATED | FAILED, "GetReal") || !fmu_is_array(instance, references, n, n) ||
        !fmu_is_array(instance, values, n, n))
        return ERROR;
    for (size_t k = 0; k < n; k++)
        if (!fmu_get_value(instance, references[k], &values[k]))
            return fmu_status(fmu_report(instance, "A value is asked of a variable that does not exist."));
    return OK;
}

EXPORT int fmi2SetReal(void *instance, const Reference references[], size_t n, const double values[])
{
    if (!fmu_is_allowed(instance, SETTABLE, "SetReal") || !fmu_is_array(instance, references, n, n) ||
        !fmu_is_array(instance, values, n, n))
        return ERROR;
    for (size_t k = 0; k < n; k++)
        if (!fmu_set_value(instance, references[k], values[k]))
            return fmu_status(fmu_report(instance, CANNOT_SET));
    return OK;
}

#define OTHER_TYPE(name, type)                                                                                         \
    EXPORT int fmi2Get##name(void *instance, const Reference references[], size_t n, type values[])                    \
    {                                                                                                                  \
        (void)references, (void)values;                                                                                \
        return fmu_status(n == 0 && fmu_is_allowed(instance, EVALUATED | FAILED, "Get" #name));                        \
    }                                                                                                                  \
    EXPORT int fmi2Set##name(void *instance, const Reference references[], size_t n, const type values[])              \
    {                                                                                                                  \
        (void)references, (void)values;                                                                                \
        return fmu_status(n == 0 && fmu_is_allowed(instance, SETTABLE, "Set" #name));                                  \
    }

typedef const char *String;
OTHER_TYPE(Integer, int)
OTHER_TYPE(Boolean, int)
OTHER_TYPE(String, String)

/* Copies of the state. */

EXPORT int fmi2GetFMUstate(void *instance, void **copy)
{
    return fmu_status(instance && fmu_copy_state(instance, copy));
}

EXPORT int fmi2SetFMUstate(void *instance, void *copy)
{
    return fmu_status(instance && fmu_restore_state(instance, copy));
}

EXPORT int fmi2FreeFMUstate(void *instance, void **copy)
{
    (void)instance;
    if (copy) {
        free(*copy);
        *copy = 0;
    }
    return OK;
}

EXPORT int fmi2SerializedFMUstateSize(void *instance, void *copy, size_t *size)
{
    (void)copy;
    if (!instance || !size)
        return ERROR;
    *size = sizeof(State);
    return OK;
}

EXPORT int fmi2SerializeFMUstate(void *instance, void *copy, char bytes[], size_t size)
{
    (void)instance;
    if (!copy || !bytes || size < sizeof(State))
        return ERROR;
    memcpy(bytes, copy, sizeof(State));
    return OK;
}

EXPORT int fmi2DeSerializeFMUstate(void *instance, const char bytes[], size_t size, void **copy)
{
    if (!instance || !bytes || size != sizeof(State) || !fmu_copy_state(instance, copy))
        return ERROR;
    memcpy(*copy, bytes, size);
    return OK;
}

EXPORT int fmi2GetDirectionalDerivative(void *instance, const Reference unknowns[], size_t n_unknowns,
                                        const Reference knowns[], size_t n_knowns, const double seeds[], double found[])
{
    if (!fmu_is_allowed(instance, EVALUATED, "GetDirectionalDerivative") ||
        !fmu_is_array(instance, unknowns, n_unknowns, n_unknowns) || !fmu_is_array(instance, found, n_unknowns, n_unknowns) ||
        !fmu_is_array(instance, knowns, n_knowns, n_knowns) || !fmu_is_array(instance, seeds, n_knowns, n_knowns))
        return ERROR;
    return fmu_status(fmu_directional(instance, unknowns, n_unknowns, knowns, n_knowns, seeds, found));
}

/* Model exchange. */

EXPORT int fmi2NewDiscreteStates(void *instance, EventInfo *info)
{
    if (!fmu_is_allowed(instance, AT_EVENT, "NewDiscreteStates") || !fmu_is_array(instance, info, 1, 1))
        return ERROR;
    const int changed = fmu_do_events(instance);
    info->again = info->nominals = 0;
    info->ends = changed < 0;
    info->states = changed > 0;
    info->next = fmu_next_event(instance);
    info->has_next = isfinite(info->next);
    return OK;
}

EXPORT int fmi2CompletedIntegratorStep(void *instance, int no_return, int *enters_events, int *ends)
{
    (void)no_return;
    if (!fmu_is_allowed(instance, CONTINUOUS, "CompletedIntegratorStep") || !enters_events || !ends)
        return ERROR;
    fmu_end_step(instance);
    *enters_events = *ends = 0;
    return OK;
}

EXPORT int fmi2GetDerivatives(void *instance, double rates[], size_t n)
{
    if (!fmu_is_exchange(instance, EVALUATED, "GetDerivatives") || !fmu_is_array(instance, rates, n, N_OWN))
        return ERROR;
    return fmu_rates_of(instance, rates) ? OK : DISCARD;
}

/* Co-simulation. */

EXPORT int fmi2SetRealInputDerivatives(void *instance, const Reference references[], size_t n, const int orders[],
                                       const double values[])
{
    (void)references, (void)orders, (void)values;
    if (!fmu_is_allowed(instance, INSTANTIATED | INITIALISING | BETWEEN_STEPS, "SetRealInputDerivatives"))
        return ERROR;
    return n ? fmu_status(fmu_report(instance, "Inputs are constant during a step.")) : OK;
}

EXPORT int fmi2GetRealOutputDerivatives(void *instance, const Reference references[], size_t n, const int orders[],
                                        double values[])
{
    (void)references, (void)orders, (void)values;
    return fmu_status(n == 0 && fmu_is_allowed(instance, STEPPED, "GetRealOutputDerivatives"));
}

EXPORT int fmi2DoStep(void *instance, double time, double step, int no_return)
{
    (void)no_return;
    const int result = fmu_step(instance, time, step);
    return result > 0 ? OK : result < 0 ? DISCARD : ERROR;
}

EXPORT int fmi2CancelStep(void *instance)
{
    (void)instance;
    return ERROR;
}

EXPORT int fmi2GetStatus(void *instance, int kind, int *value)
{
    (void)kind, (void)value;
    return fmu_is_allowed(instance, STEPPED, "GetStatus") ? DISCARD : ERROR;
}

EXPORT int fmi2GetRealStatus(void *instance, int kind, double *value)
{
    enum { LAST_TIME = 2 };
    if (!fmu_is_allowed(instance, STEPPED, "GetRealStatus") || !value)
        return ERROR;
    *value = ((Instance *)instance)->state.model.t;
    return kind == LAST_TIME ? OK : DISCARD;
}

EXPORT int fmi2GetIntegerStatus(void *instance, int kind, int *value)
{
    (void)kind, (void)value;
    return fmu_is_allowed(instance, STEPPED, "GetIntegerStatus") ? DISCARD : ERROR;
}

EXPORT int fmi2GetBooleanStatus(void *instance, int kind, int *value)
{
    enum { ENDED = 3 };
    if (!fmu_is_allowed(instance, STEPPED, "GetBooleanStatus") || !value)
        return ERROR;
    *value = ((Instance *)instance)->work.has_ended;
    return kind == ENDED ? OK : DISCARD;
}

EXPORT int fmi2GetStringStatus(void *instance, int kind, const char **value)
{
    (void)kind, (void)value;
    return fmu_is_allowed(instance, STEPPED, "GetStringStatus") ? DISCARD : ERROR;
}
