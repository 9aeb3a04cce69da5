/* What FMI 2.0 and 3.0 have in common, but for the prefix of the names. */
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { OK, WARNING, DISCARD, ERROR, FATAL };
typedef unsigned int Reference;

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
    if (!fmu_end_initialisation(i))
        return ERROR;
    return fmu_status(!i->is_co_simulation || fmu_do_events(i) >= 0);
}

/* Changes of the mode, which need nothing here: values are evaluated when they are asked for. */
#define MODE(name)                                                                                                     \
    EXPORT int FMI_##name(void *instance)                                                                              \
    {                                                                                                                  \
        (void)instance;                                                                                                \
        return OK;                                                                                                     \
    }

MODE(EnterEventMode)
MODE(EnterContinuousTimeMode)
MODE(Terminate)

EXPORT int FMI_Reset(void *instance)
{
    fmu_begin(instance);
    return OK;
}

EXPORT int FMI_SetTime(void *instance, double time)
{
    fmu_set_time(instance, time);
    return OK;
}

EXPORT int FMI_SetContinuousStates(void *instance, const double states[], size_t n)
{
    if (n != N_OWN)
        return ERROR;
    fmu_set_states(instance, states);
    return OK;
}

EXPORT int FMI_GetEventIndicators(void *instance, double z[], size_t n)
{
    if (n != N_INDICATORS)
        return ERROR;
    fmu_indicators(instance, z);
    return OK;
}

EXPORT int FMI_GetContinuousStates(void *instance, double states[], size_t n)
{
    if (n != N_OWN)
        return ERROR;
    fmu_get_states(instance, states);
    return OK;
}

EXPORT int FMI_GetNominalsOfContinuousStates(void *instance, double nominals[], size_t n)
{
    (void)instance;
    if (n != N_OWN)
        return ERROR;
    for (int k = 0; k < N_OWN; k++)
        nominals[k] = fmu_nominal[fmu_own_state[k]];
    return OK;
}
