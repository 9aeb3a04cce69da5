/* The functions of FMI 3.0. */
#define GETTABLE (INSTANTIATED | EVALUATED | FAILED)
typedef void (*Logger)(void *, int, const char *, const char *);

static void fmu_log_error(Instance *i, const char *text)
{
    ((Logger)i->logger)(i->environment, ERROR, "error", text);
}

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT int fmi3SetDebugLogging(void *instance, bool on, size_t n, const char *const categories[])
{
    (void)instance, (void)on, (void)n, (void)categories;
    return OK;
}

static void *fmu_instantiate(const char *name, const char *token, void *environment, Logger logger,
                             int is_co_simulation)
{
    Instance *i = fmu_new_instance(name, token, TOKEN);
    if (!i) {
        if (logger)
            logger(environment, ERROR, "error", "The instantiation token is not that of this FMU.");
        return 0;
    }
    i->is_co_simulation = is_co_simulation;
    i->environment = environment;
    i->logger = (void *)logger;
    i->log = logger ? fmu_log_error : 0;
    return i;
}

EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                          bool logging, void *environment, Logger logger)
{
    (void)resources, (void)visible, (void)logging;
    return fmu_instantiate(name, token, environment, logger, 0);
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool event_mode, bool early_return,
                                         const Reference intermediate[], size_t n_intermediate, void *environment,
                                         Logger logger, void *update)
{
    (void)resources, (void)visible, (void)logging, (void)early_return, (void)intermediate, (void)n_intermediate;
    (void)update;
    if (event_mode) {
        if (logger)
            logger(environment, ERROR, "error", "This FMU has no event mode in co-simulation.");
        return 0;
    }
    return fmu_instantiate(name, token, environment, logger, 1);
}

EXPORT void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
                                               bool logging, void *environment, Logger logger, void *clock, void *lock,
                                               void *unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)clock, (void)lock, (void)unlock;
    if (logger)
        logger(environment, ERROR, "error", "This FMU has no scheduled execution.");
    return 0;
}

EXPORT int fmi3EnterInitializationMode(void *instance, bool has_tolerance, double tolerance, double start,
                                       bool has_stop, double stop)
{
    return fmu_status(fmu_is_allowed(instance, INSTANTIATED, "EnterInitializationMode") &&
                      fmu_begin_initialisation(instance, start, has_tolerance ? tolerance : 0.0,
                                               has_stop ? stop : INFINITY) &&
                      fmu_enter(instance, INITIALISING));
}

/* Variables: all are real numbers. */

EXPORT int fmi3GetFloat64(void *instance, const Reference references[], size_t n, double values[], size_t n_values)
{
    if (!fmu_is_allowed(instance, GETTABLE, "GetFloat64") || !fmu_is_array(instance, references, n, n_values) ||
        !fmu_is_array(instance, values, n_values, n))
        return ERROR;
    for (size_t k = 0; k < n; k++)
        if (!fmu_get_value(instance, references[k], &values[k]))
            return fmu_status(fmu_report(instance, "A value is asked of a variable that does not exist."));
    return OK;
}

EXPORT int fmi3SetFloat64(void *instance, const Reference references[], size_t n, const double values[],
                          size_t n_values)
{
    if (!fmu_is_allowed(instance, SETTABLE, "SetFloat64") || !fmu_is_array(instance, references, n, n_values) ||
        !fmu_is_array(instance, values, n_values, n))
        return ERROR;
    for (size_t k = 0; k < n; k++)
        if (!fmu_set_value(instance, references[k], values[k]))
            return fmu_status(fmu_report(instance, CANNOT_SET));
    return OK;
}

#define OTHER_TYPE(name, type)                                                                                         \
    EXPORT int fmi3Get##name(void *instance, const Reference references[], size_t n, type values[], size_t n_values)   \
    {                                                                                                                  \
        (void)references, (void)values, (void)n_values;                                                                \
        return fmu_status(n == 0 && fmu_is_allowed(instance, GETTABLE, "Get" #name));                                  \
    }                                                                                                                  \
    EXPORT int fmi3Set##name(void *instance, const Reference references[], size_t n, const type values[],              \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        (void)references, (void)values, (void)n_values;                                                                \
        return fmu_status(n == 0 && fmu_is_allowed(instance, SETTABLE, "Set" #name));                                  \
    }

OTHER_TYPE(Float32, float)
OTHER_TYPE(Int8, int8_t)
OTHER_TYPE(UInt8, uint8_t)
OTHER_TYPE(Int16, int16_t)
OTHER_TYPE(UInt16, uint16_t)
OTHER_TYPE(Int32, int32_t)
OTHER_TYPE(UInt32, uint32_t)
OTHER_TYPE(Int64, int64_t)
OTHER_TYPE(UInt64, uint64_t)
OTHER_TYPE(Boolean, bool)
typedef const char *String;
OTHER_TYPE(String, String)

EXPORT int fmi3GetBinary(void *instance, const Reference references[], size_t n, size_t sizes[],
                         const uint8_t *values[], size_t n_values)
{
    (void)instance, (void)references, (void)sizes, (void)values, (void)n_values;
    return fmu_status(n == 0);
}

EXPORT int fmi3SetBinary(void *instance, const Reference references[], size_t n, const size_t sizes[],
                         const uint8_t *const values[], size_t n_values)
{
    (void)instance, (void)references, (void)sizes, (void)values, (void)n_values;
    return fmu_status(n == 0);
}

EXPORT int fmi3GetClock(void *instance, const Reference references[], size_t n, bool values[])
{
    (void)instance, (void)references, (void)values;
    return fmu_status(n == 0);
}

EXPORT int fmi3SetClock(void *instance, const Reference references[], size_t n, const bool values[])
{
    (void)instance, (void)references, (void)values;
    return fmu_status(n == 0);
}

EXPORT int fmi3GetNumberOfVariableDependencies(void *instance, Reference reference, size_t *n)
{
    (void)reference, (void)n;
    return fmu_status(fmu_report(instance, "The dependencies of variables are those of the model description."));
}

EXPORT int fmi3GetVariableDependencies(void *instance, Reference dependent, size_t elements[], Reference independents[],
                                       size_t others[], int kinds[], size_t n)
{
    (void)dependent, (void)elements, (void)independents, (void)others, (void)kinds, (void)n;
    return fmu_status(fmu_report(instance, "The dependencies of variables are those of the model description."));
}

/* Copies of the state. */

EXPORT int fmi3GetFMUState(void *instance, void **copy)
{
    return fmu_status(instance && fmu_copy_state(instance, copy));
}

EXPORT int fmi3SetFMUState(void *instance, void *copy)
{
    return fmu_status(instance && fmu_restore_state(instance, copy));
}

EXPORT int fmi3FreeFMUState(void *instance, void **copy)
{
    (void)instance;
    if (copy) {
        free(*copy);
        *copy = 0;
    }
    return OK;
}

EXPORT int fmi3SerializedFMUStateSize(void *instance, void *copy, size_t *size)
{
    (void)copy;
    if (!instance || !size)
        return ERROR;
    *size = sizeof(State);
    return OK;
}

EXPORT int fmi3SerializeFMUState(void *instance, void *copy, uint8_t bytes[], size_t size)
{
    (void)instance;
    if (!copy || !bytes || size < sizeof(State))
        return ERROR;
    memcpy(bytes, copy, sizeof(State));
    return OK;
}

EXPORT int fmi3DeserializeFMUState(void *instance, const uint8_t bytes[], size_t size, void **copy)
{
    if (!instance || !bytes || size != sizeof(State) || !fmu_copy_state(instance, copy))
        return ERROR;
    memcpy(*copy, bytes, size);
    return OK;
}

/* Derivatives. */

EXPORT int fmi3GetDirectionalDerivative(void *instance, const Reference unknowns[], size_t n_unknowns,
                                        const Reference knowns[], size_t n_knowns, const double seeds[],
                                        size_t n_seeds, double found[], size_t n_found)
{
    if (!fmu_is_allowed(instance, EVALUATED, "GetDirectionalDerivative") ||
        !fmu_is_array(instance, unknowns, n_unknowns, n_found) || !fmu_is_array(instance, found, n_found, n_unknowns) ||
        !fmu_is_array(instance, knowns, n_knowns, n_seeds) || !fmu_is_array(instance, seeds, n_seeds, n_knowns))
        return ERROR;
    return fmu_status(fmu_directional(instance, unknowns, n_unknowns, knowns, n_knowns, seeds, found));
}

/* The product of seeds of unknowns with the derivatives by the known variables: one direction for each of these. */
static int fmu_adjoint(Instance *i, const unsigned int *unknowns, size_t n_unknowns, const unsigned int *knowns,
                       size_t n_knowns, const double *seeds, double *found)
{
    double *column = malloc((n_unknowns + 1) * sizeof(double));
    int is_fine = column != 0;
    for (size_t j = 0; is_fine && j < n_knowns; j++) {
        const double one = 1.0;
        is_fine = fmu_directional(i, unknowns, n_unknowns, &knowns[j], 1, &one, column);
        found[j] = 0.0;
        for (size_t k = 0; is_fine && k < n_unknowns; k++)
            found[j] += seeds[k] * column[k];
    }
    free(column);
    return is_fine;
}

EXPORT int fmi3GetAdjointDerivative(void *instance, const Reference unknowns[], size_t n_unknowns,
                                    const Reference knowns[], size_t n_knowns, const double seeds[], size_t n_seeds,
                                    double found[], size_t n_found)
{
    if (!fmu_is_allowed(instance, EVALUATED, "GetAdjointDerivative") ||
        !fmu_is_array(instance, unknowns, n_unknowns, n_seeds) || !fmu_is_array(instance, seeds, n_seeds, n_unknowns) ||
        !fmu_is_array(instance, knowns, n_knowns, n_found) || !fmu_is_array(instance, found, n_found, n_knowns))
        return ERROR;
    return fmu_status(fmu_adjoint(instance, unknowns, n_unknowns, knowns, n_knowns, seeds, found));
}

/* Configuration and clocks, which this FMU does not have. */

EXPORT int fmi3EnterConfigurationMode(void *instance)
{
    return fmu_status(fmu_report(instance, "This FMU has no structural parameters."));
}

EXPORT int fmi3ExitConfigurationMode(void *instance)
{
    return fmu_status(fmu_report(instance, "This FMU has no structural parameters."));
}

#define OF_CLOCKS(name, first, second)                                                                                 \
    EXPORT int fmi3##name(void *instance, const Reference references[], size_t n, first, second)                       \
    {                                                                                                                  \
        (void)instance, (void)references, (void)a, (void)b;                                                            \
        return fmu_status(n == 0);                                                                                     \
    }

OF_CLOCKS(GetIntervalDecimal, double a[], int b[])
OF_CLOCKS(GetShiftFraction, uint64_t a[], uint64_t b[])
OF_CLOCKS(SetIntervalFraction, const uint64_t a[], const uint64_t b[])
OF_CLOCKS(SetShiftFraction, const uint64_t a[], const uint64_t b[])

EXPORT int fmi3GetIntervalFraction(void *instance, const Reference references[], size_t n, uint64_t counters[],
                                   uint64_t resolutions[], int qualifiers[])
{
    (void)instance, (void)references, (void)counters, (void)resolutions, (void)qualifiers;
    return fmu_status(n == 0);
}

EXPORT int fmi3GetShiftDecimal(void *instance, const Reference references[], size_t n, double shifts[])
{
    (void)instance, (void)references, (void)shifts;
    return fmu_status(n == 0);
}

EXPORT int fmi3SetIntervalDecimal(void *instance, const Reference references[], size_t n, const double intervals[])
{
    (void)instance, (void)references, (void)intervals;
    return fmu_status(n == 0);
}

EXPORT int fmi3SetShiftDecimal(void *instance, const Reference references[], size_t n, const double shifts[])
{
    (void)instance, (void)references, (void)shifts;
    return fmu_status(n == 0);
}

EXPORT int fmi3ActivateModelPartition(void *instance, Reference clock, double time)
{
    (void)clock, (void)time;
    return fmu_status(fmu_report(instance, "This FMU has no scheduled execution."));
}

EXPORT int fmi3EvaluateDiscreteStates(void *instance)
{
    return fmu_status(fmu_is_allowed(instance, INITIALISING | AT_EVENT, "EvaluateDiscreteStates"));
}

/* Model exchange. */

EXPORT int fmi3UpdateDiscreteStates(void *instance, bool *again, bool *ends, bool *nominals, bool *states,
                                    bool *has_next, double *next)
{
    if (!fmu_is_allowed(instance, AT_EVENT, "UpdateDiscreteStates") || !again || !ends || !nominals || !states ||
        !has_next || !next)
        return ERROR;
    const int changed = fmu_do_events(instance);
    *again = *nominals = false;
    *ends = changed < 0;
    *states = changed > 0;
    *next = fmu_next_event(instance);
    *has_next = isfinite(*next);
    return OK;
}

EXPORT int fmi3CompletedIntegratorStep(void *instance, bool no_return, bool *enters_events, bool *ends)
{
    (void)no_return;
    if (!fmu_is_allowed(instance, CONTINUOUS, "CompletedIntegratorStep") || !enters_events || !ends)
        return ERROR;
    fmu_end_step(instance);
    *enters_events = *ends = false;
    return OK;
}

EXPORT int fmi3GetContinuousStateDerivatives(void *instance, double rates[], size_t n)
{
    if (!fmu_is_exchange(instance, EVALUATED, "GetContinuousStateDerivatives") ||
        !fmu_is_array(instance, rates, n, N_OWN))
        return ERROR;
    return fmu_rates_of(instance, rates) ? OK : DISCARD;
}

EXPORT int fmi3GetNumberOfEventIndicators(void *instance, size_t *n)
{
    if (!instance || !n)
        return ERROR;
    *n = N_INDICATORS;
    return OK;
}

EXPORT int fmi3GetNumberOfContinuousStates(void *instance, size_t *n)
{
    if (!instance || !n)
        return ERROR;
    *n = N_OWN;
    return OK;
}

/* Co-simulation. */

EXPORT int fmi3EnterStepMode(void *instance)
{
    return fmu_status(instance && fmu_report(instance, "This FMU has no event mode in co-simulation."));
}

EXPORT int fmi3GetOutputDerivatives(void *instance, const Reference references[], size_t n, const int32_t orders[],
                                    double values[], size_t n_values)
{
    (void)references, (void)orders, (void)values, (void)n_values;
    return fmu_status(n == 0 && fmu_is_allowed(instance, STEPPED, "GetOutputDerivatives"));
}

EXPORT int fmi3DoStep(void *instance, double time, double step, bool no_return, bool *has_event, bool *ends,
                      bool *early, double *last)
{
    (void)no_return;
    if (!instance || !has_event || !ends || !early || !last)
        return ERROR;
    const int result = fmu_step(instance, time, step);
    *has_event = *early = false;
    *ends = result < 0;
    *last = ((Instance *)instance)->state.model.t;
    return fmu_status(result != 0);
}
