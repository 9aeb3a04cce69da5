/* What FMI 2.0 and 3.0 have in common, but for the prefix of the names. */
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { OK, WARNING, DISCARD, ERROR, FATAL };
typedef unsigned int Reference;
#define SETTABLE (INSTANTIATED | INITIALISING | AT_EVENT | CONTINUOUS | BETWEEN_STEPS)
#define STEPPED (BETWEEN_STEPS | DISCARDED | TERMINATED)

static int fmu_status(int is_fine)
{
    return is_fine ? OK : ERROR;
}

EXPORT void FMI_FreeInstance(void *instance)
{
    free(instance);
}

EXPORT int FMI_ExitInitializationMode(void *instance)
{
    Instance *i = instance;
    if (!fmu_is_allowed(i, INITIALISING, "ExitInitializationMode"))
        return ERROR;
    const int is_fine = fmu_is_admissible(i) && (!i->is_co_simulation || fmu_do_events(i) >= 0);
    fmu_enter(i, !is_fine ? FAILED : i->is_co_simulation ? BETWEEN_STEPS : AT_EVENT);
    return fmu_status(is_fine);
}

/* Changes of the mode: values are evaluated when they are asked for. */
#define MODE(name, from, to)                                                                                           \
    EXPORT int FMI_##name(void *instance)                                                                              \
    {                                                                                                                  \
        return fmu_status(fmu_is_allowed(instance, from, #name) && fmu_enter(instance, to));                           \
    }

MODE(EnterEventMode, AT_EVENT | CONTINUOUS, AT_EVENT)
MODE(Terminate, AT_EVENT | CONTINUOUS | BETWEEN_STEPS | DISCARDED, TERMINATED)

EXPORT int FMI_EnterContinuousTimeMode(void *instance)
{
    return fmu_status(fmu_is_allowed(instance, AT_EVENT, "EnterContinuousTimeMode") && fmu_is_admissible(instance) &&
                      fmu_enter(instance, CONTINUOUS));
}

EXPORT int FMI_Reset(void *instance)
{
    if (!instance)
        return ERROR;
    fmu_begin(instance);
    return OK;
}

EXPORT int FMI_SetTime(void *instance, double time)
{
    if (!fmu_is_exchange(instance, AT_EVENT | CONTINUOUS, "SetTime"))
        return ERROR;
    if (!isfinite(time))
        return fmu_status(fmu_report(instance, "A time must be finite."));
    fmu_set_time(instance, time);
    return OK;
}

EXPORT int FMI_SetContinuousStates(void *instance, const double states[], size_t n)
{
    if (!fmu_is_exchange(instance, CONTINUOUS, "SetContinuousStates") || !fmu_is_array(instance, states, n, N_OWN))
        return ERROR;
    fmu_set_states(instance, states);
    return OK;
}

EXPORT int FMI_GetEventIndicators(void *instance, double z[], size_t n)
{
    if (!fmu_is_exchange(instance, EVALUATED, "GetEventIndicators") || !fmu_is_array(instance, z, n, N_INDICATORS))
        return ERROR;
    fmu_indicators(instance, z);
    return OK;
}

EXPORT int FMI_GetContinuousStates(void *instance, double states[], size_t n)
{
    if (!fmu_is_exchange(instance, EVALUATED, "GetContinuousStates") || !fmu_is_array(instance, states, n, N_OWN))
        return ERROR;
    fmu_get_states(instance, states);
    return OK;
}

EXPORT int FMI_GetNominalsOfContinuousStates(void *instance, double nominals[], size_t n)
{
    if (!fmu_is_exchange(instance, INSTANTIATED | EVALUATED, "GetNominalsOfContinuousStates") ||
        !fmu_is_array(instance, nominals, n, N_OWN))
        return ERROR;
    for (int k = 0; k < N_OWN; k++)
        nominals[k] = fmu_nominal[fmu_own_state[k]];
    return OK;
}
