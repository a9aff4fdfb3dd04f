/* FMI 3.0 for co-simulation over any model of model.h: the types and names of that version, and what only it has.
   All else: instance.c; what this FMU does not have: fmi3_absent.c. Variables have the value references of model.h; the
   independent variable, time, comes after them. */
#include "instance.h"

#include "fmi3Functions.h"

#include <math.h>
#include <stdlib.h>

/* ---------------------------------------------------------------------------------------------------- log and life */

static void write_log(const Host *host, const char *instance, Status status, const char *category, const char *text) {
    const fmi3LogMessageCallback log_message = (fmi3LogMessageCallback)host->logger;
    (void)instance; /* the environment identifies it */
    log_message(host->environment, (fmi3Status)status, category, text);
}

static Host host_of(fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    const Host host = {environment, (void (*)(void))logMessage, write_log, calloc, free};
    return host;
}

static fmi3Instance refuse_instance(const Host *host, const char *text) {
    if (host->logger) write_log(host, "", STATUS_ERROR, "logStatusError", text);
    return NULL;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate) {
    const Host host = host_of(instanceEnvironment, logMessage);
    (void)resourcePath; /* everything is inside the binary */
    (void)visible;
    (void)earlyReturnAllowed; /* steps are never left early */
    (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    if (eventModeUsed) return refuse_instance(&host, "this FMU has no event mode; instantiate it without");
    if (nRequiredIntermediateVariables)
        return refuse_instance(&host, "this FMU has no intermediate update; instantiate it without such variables");
    return instance_create(&host, instanceName, instantiationToken, loggingOn);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    const Host host = host_of(instanceEnvironment, logMessage);
    (void)instanceName;
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    return refuse_instance(&host, "this FMU is for co-simulation only");
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    return fmi3InstantiateModelExchange(instanceName, instantiationToken, resourcePath, visible, loggingOn,
                                        instanceEnvironment, logMessage);
}

void fmi3FreeInstance(fmi3Instance instance) { instance_free(instance); }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    return (fmi3Status)instance_set_logging(instance, loggingOn, nCategories, categories, __func__);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    const Status status = instance_set_up(instance, startTime, stopTimeDefined ? stopTime : INFINITY, __func__);
    (void)toleranceDefined; /* the tolerance of the inner steps is fixed */
    (void)tolerance;
    if (status != STATUS_OK) return (fmi3Status)status;
    return (fmi3Status)instance_enter_initialization(instance, __func__);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    return (fmi3Status)instance_exit_initialization(instance, __func__);
}

fmi3Status fmi3Terminate(fmi3Instance instance) { return (fmi3Status)instance_terminate(instance, __func__); }

fmi3Status fmi3Reset(fmi3Instance instance) { return (fmi3Status)instance_reset(instance, __func__); }

/* ----------------------------------------------------------------------------------------------------------- values */

/* All variables are scalars: there are as many values as value references. */
static Status judge_count(Instance *self, size_t references, size_t values, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (references == values) return STATUS_OK;
    return instance_report(self, STATUS_ERROR, "%s: %lu values for %lu variables", function, (unsigned long)values,
                           (unsigned long)references);
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    const Instance *self = instance;
    Status worst = judge_count(instance, nValueReferences, nValues, __func__);
    if (worst == STATUS_OK && nValues && (!valueReferences || !values))
        worst = instance_report(instance, STATUS_ERROR, "%s: an array is NULL", __func__);
    for (size_t i = 0; i < nValues && worst <= STATUS_WARNING; i++) {
        Status status = STATUS_OK;
        if (valueReferences[i] == model_variable_count) {
            values[i] = self->model.time;
            continue;
        }
        status = instance_prepare_get(instance, &valueReferences[i], 1, values, REAL, __func__);
        if (status <= STATUS_WARNING) values[i] = self->values[valueReferences[i]];
        if (status > worst) worst = status;
    }
    return (fmi3Status)worst;
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues) {
    const Instance *self = instance;
    Status status = judge_count(instance, nValueReferences, nValues, __func__);
    if (status == STATUS_OK)
        status = instance_prepare_get(instance, valueReferences, nValues, values, BOOLEAN, __func__);
    if (status > STATUS_WARNING) return (fmi3Status)status;
    for (size_t i = 0; i < nValues; i++) values[i] = self->values[valueReferences[i]] != 0.0;
    return (fmi3Status)status;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    Status status = judge_count(instance, nValueReferences, nValues, __func__);
    if (status == STATUS_OK) status = instance_prepare_set(instance, valueReferences, nValues, values, REAL, __func__);
    if (status != STATUS_OK) return (fmi3Status)status;
    for (size_t i = 0; i < nValues; i++) instance_put(instance, valueReferences[i], values[i]);
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues) {
    Status status = judge_count(instance, nValueReferences, nValues, __func__);
    if (status == STATUS_OK)
        status = instance_prepare_set(instance, valueReferences, nValues, values, BOOLEAN, __func__);
    if (status != STATUS_OK) return (fmi3Status)status;
    for (size_t i = 0; i < nValues; i++) instance_put(instance, valueReferences[i], values[i] ? 1.0 : 0.0);
    return fmi3OK;
}

/* ----------------------------------------------------------------------------------------------------------- states */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return (fmi3Status)instance_save(instance, FMUState, __func__);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    return (fmi3Status)instance_restore(instance, FMUState, __func__);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return (fmi3Status)instance_free_state(instance, FMUState, __func__);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    return (fmi3Status)instance_serialized_size(instance, FMUState, size, __func__);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    return (fmi3Status)instance_serialize(instance, FMUState, serializedState, size, __func__);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    return (fmi3Status)instance_deserialize(instance, serializedState, size, FMUState, __func__);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    Status status = judge_count(instance, nKnowns, nSeed, __func__);
    if (status == STATUS_OK) status = judge_count(instance, nUnknowns, nSensitivity, __func__);
    if (status != STATUS_OK) return (fmi3Status)status;
    return (fmi3Status)instance_derivatives(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity,
                                            __func__);
}

/* ------------------------------------------------------------------------------------------------------------ steps */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    const Instance *self = instance;
    Status status;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!instance_allows(instance, STEPPING, __func__)) return fmi3Error;
    if (!eventHandlingNeeded || !terminateSimulation || !earlyReturn || !lastSuccessfulTime)
        return (fmi3Status)instance_report(instance, STATUS_ERROR, "%s: an argument is NULL", __func__);
    status = instance_step(instance, currentCommunicationPoint, communicationStepSize, __func__);
    *eventHandlingNeeded = fmi3False;
    *terminateSimulation = fmi3False;
    *earlyReturn = fmi3False;
    *lastSuccessfulTime = self->model.time;
    return (fmi3Status)status;
}
