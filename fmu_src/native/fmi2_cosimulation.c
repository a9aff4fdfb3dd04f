/* FMI 2.0 for co-simulation over any model of model.h: the types and names of that version, and what only it has.
   All else: instance.c. */
#include "instance.h"

#include "fmi2Functions.h"

#include <math.h>
#include <stdlib.h>

/* ---------------------------------------------------------------------------------------------------- log and life */

static void write_log(const Host *host, const char *instance, Status status, const char *category, const char *text) {
    const fmi2CallbackLogger logger = (fmi2CallbackLogger)host->logger;
    char format[2 * MESSAGE_SIZE]; /* hosts take a message as a printf format */
    size_t length = 0;
    for (; *text && length + 3 < sizeof format; text++) {
        if (*text == '%') format[length++] = '%';
        format[length++] = *text;
    }
    format[length] = '\0';
    logger(host->environment, instance, (fmi2Status)status, category, format);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    Host host = {NULL, NULL, write_log, calloc, free};
    (void)fmuResourceLocation; /* everything is inside the binary */
    (void)visible;
    if (!functions) return NULL;
    host.environment = functions->componentEnvironment;
    host.logger = (void (*)(void))functions->logger;
    if (functions->allocateMemory && functions->freeMemory) {
        host.allocate = functions->allocateMemory;
        host.release = functions->freeMemory;
    }
    if (fmuType != fmi2CoSimulation) {
        if (host.logger)
            write_log(&host, instanceName ? instanceName : "", STATUS_ERROR, "logStatusError",
                      "this FMU is for co-simulation only");
        return NULL;
    }
    return instance_create(&host, instanceName, fmuGUID, loggingOn != fmi2False);
}

void fmi2FreeInstance(fmi2Component c) { instance_free(c); }

fmi2String fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2String fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    return (fmi2Status)instance_set_logging(c, loggingOn != fmi2False, nCategories, categories, __func__);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined; /* the tolerance of the inner steps is fixed */
    (void)tolerance;
    return (fmi2Status)instance_set_up(c, startTime, stopTimeDefined ? stopTime : INFINITY, __func__);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return (fmi2Status)instance_enter_initialization(c, __func__);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (fmi2Status)instance_exit_initialization(c, __func__); }

fmi2Status fmi2Terminate(fmi2Component c) { return (fmi2Status)instance_terminate(c, __func__); }

fmi2Status fmi2Reset(fmi2Component c) { return (fmi2Status)instance_reset(c, __func__); }

/* ----------------------------------------------------------------------------------------------------------- values */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    const Instance *self = c;
    const Status status = instance_prepare_get(c, vr, nvr, value, REAL, __func__);
    if (status > STATUS_WARNING) return (fmi2Status)status;
    for (size_t i = 0; i < nvr; i++) value[i] = self->values[vr[i]];
    return (fmi2Status)status;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    const Instance *self = c;
    const Status status = instance_prepare_get(c, vr, nvr, value, BOOLEAN, __func__);
    if (status > STATUS_WARNING) return (fmi2Status)status;
    for (size_t i = 0; i < nvr; i++) value[i] = self->values[vr[i]] != 0.0 ? fmi2True : fmi2False;
    return (fmi2Status)status;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    const Status status = instance_prepare_set(c, vr, nvr, value, REAL, __func__);
    if (status != STATUS_OK) return (fmi2Status)status;
    for (size_t i = 0; i < nvr; i++) instance_put(c, vr[i], value[i]);
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    const Status status = instance_prepare_set(c, vr, nvr, value, BOOLEAN, __func__);
    if (status != STATUS_OK) return (fmi2Status)status;
    for (size_t i = 0; i < nvr; i++) instance_put(c, vr[i], value[i] != fmi2False);
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return (fmi2Status)instance_without(c, nvr, "Integer", __func__);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return (fmi2Status)instance_without(c, nvr, "Integer", __func__);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    (void)vr;
    (void)value;
    return (fmi2Status)instance_without(c, nvr, "String", __func__);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    (void)vr;
    (void)value;
    return (fmi2Status)instance_without(c, nvr, "String", __func__);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    return (fmi2Status)instance_set_rates(c, vr, nvr, order, value, __func__);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr;
    (void)order;
    (void)value;
    if (!instance_allows(c, ANY_MODE, __func__)) return fmi2Error;
    return nvr ? (fmi2Status)instance_report(c, STATUS_ERROR, "%s: outputs have no derivatives here", __func__)
               : fmi2OK;
}

/* ----------------------------------------------------------------------------------------------------------- states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return (fmi2Status)instance_save(c, FMUstate, __func__);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    return (fmi2Status)instance_restore(c, FMUstate, __func__);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return (fmi2Status)instance_free_state(c, FMUstate, __func__);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    return (fmi2Status)instance_serialized_size(c, FMUstate, size, __func__);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    return (fmi2Status)instance_serialize(c, FMUstate, serializedState, size, __func__);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    return (fmi2Status)instance_deserialize(c, serializedState, size, FMUstate, __func__);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    return (fmi2Status)instance_derivatives(c, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown,
                                            __func__);
}

/* ------------------------------------------------------------------------------------------------------------ steps */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)instance_step(c, currentCommunicationPoint, communicationStepSize, __func__);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    if (!instance_allows(c, ANY_MODE, __func__)) return fmi2Error;
    instance_report(c, STATUS_ERROR, "%s: there is no step to cancel; steps end before fmi2DoStep returns", __func__);
    return fmi2Error;
}

static fmi2Status status_fault(Instance *self, const void *value, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return fmi2Error;
    if (!value) return (fmi2Status)instance_report(self, STATUS_ERROR, "%s: value is NULL", function);
    return (fmi2Status)instance_report(self, STATUS_DISCARD, "%s: that status is not known", function);
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    const Instance *self = c;
    if (!c || !value || s != fmi2DoStepStatus) return status_fault(c, value, __func__);
    *value = (fmi2Status)self->last_step;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    const Instance *self = c;
    if (!c || !value || s != fmi2LastSuccessfulTime) return status_fault(c, value, __func__);
    *value = self->model.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    return status_fault(c, value, __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    const Instance *self = c;
    if (!c || !value || s != fmi2Terminated) return status_fault(c, value, __func__);
    /* After a refused step: a host that does not correct what was refused must end, or it tries the same for ever. */
    *value = self->last_step == STATUS_DISCARD ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    (void)s;
    return status_fault(c, value, __func__);
}
