/* FMI 2.0 for co-simulation over any model of model.h: log, life cycle, values, steps. Saved states: fmi2_state.c.

   A call that is not allowed, or whose arguments are at fault, returns fmi2Error with a message and changes nothing, so
   that the host may go on. What has no result for the values at hand (a step, an output) is told by fmi2Discard or
   fmi2Warning and NaN, and works again once the values are corrected. There is no data outside the instances. */
#include "fmi2_instance.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define LONGEST_STEP_S 1e9
#define BOUND_TOLERANCE 1e-9 /* a bound converted from another unit, or reached by a ramp, is a rounding off */
#define TIME_TOLERANCE 1e-6  /* of the time itself, where the host's clock and ours are compared */
#define KELVIN 273.15

/* -------------------------------------------------------------------------------------------------------------- log */

static const char *const CATEGORIES[] = {"", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                         "logStatusFatal"};
#define EVERY_STATUS ((1u << fmi2Warning) | (1u << fmi2Discard) | (1u << fmi2Error) | (1u << fmi2Fatal))
#define FAILURES (EVERY_STATUS & ~(1u << fmi2Warning)) /* without these a host could not say why it stopped */

static void tell(const fmi2CallbackFunctions *callbacks, const char *name, fmi2Status status, const char *text) {
    char format[2 * MESSAGE_SIZE]; /* hosts take a message as a printf format */
    size_t length = 0;
    if (!callbacks->logger) return;
    for (; *text && length + 3 < sizeof format; text++) {
        if (*text == '%') format[length++] = '%';
        format[length++] = *text;
    }
    format[length] = '\0';
    callbacks->logger(callbacks->componentEnvironment, name, status, CATEGORIES[status], format);
}

fmi2Status report(Instance *self, fmi2Status status, const char *format, ...) {
    char text[MESSAGE_SIZE + 128];
    va_list arguments;
    if (self->logged & (1u << status)) {
        va_start(arguments, format);
        vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        tell(&self->callbacks, self->name, status, text);
    }
    return status;
}

static const char *mode_text(Mode mode) {
    switch (mode) {
    case INSTANTIATED: return "before fmi2EnterInitializationMode";
    case INITIALIZATION: return "in initialization mode";
    case STEP_COMPLETE: return "after the initialization";
    case STEP_FAILED: return "after a refused step";
    case TERMINATED: return "after fmi2Terminate";
    default: return "after a fault; fmi2Reset or a saved state helps";
    }
}

int allowed(Instance *self, unsigned modes, const char *function) {
    if (!self) return 0;
    if (self->mode & modes) return 1;
    report(self, fmi2Error, "%s is not allowed %s", function, mode_text(self->mode));
    return 0;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    Instance *self = c;
    unsigned chosen = nCategories ? 0 : EVERY_STATUS;
    if (!allowed(self, ANY, "fmi2SetDebugLogging")) return fmi2Error;
    if (nCategories && !categories) return report(self, fmi2Error, "fmi2SetDebugLogging: categories is NULL");
    for (size_t i = 0; i < nCategories; i++) {
        unsigned found = categories[i] && !strcmp(categories[i], "logAll") ? EVERY_STATUS : 0;
        for (int status = fmi2Warning; status <= fmi2Fatal; status++)
            if (categories[i] && !strcmp(categories[i], CATEGORIES[status])) found = 1u << status;
        if (!found)
            return report(self, fmi2Error, "there is no log category '%s'", categories[i] ? categories[i] : "NULL");
        chosen |= found;
    }
    self->logged = loggingOn ? self->logged | chosen : self->logged & ~chosen;
    return fmi2OK;
}

/* ---------------------------------------------------------------------------------------------------- usable values */

static int usable(const Variable *variable, double value) {
    const double slack = BOUND_TOLERANCE * fmax(1.0, fabs(value));
    return variable->access == CALCULATED
        || (isfinite(value) && value >= variable->minimum - slack && value <= variable->maximum + slack);
}

/* Why a value cannot be used, and what was probably meant. Gives the length. */
static int describe(const Variable *v, double value, char *text, size_t size) {
    const char *unit = strcmp(v->unit, "1") ? v->unit : "", *space = *unit ? " " : "";
    int length;
    if (!isfinite(value)) return snprintf(text, size, "%s is %g; a finite number is needed", v->name, value);
    length = snprintf(text, size, "%s is %g%s%s; %g to %g%s%s is possible", v->name, value, space, unit, v->minimum,
                      v->maximum, space, unit);
    if (length < 0 || (size_t)length >= size) return length;
    text += length, size -= (size_t)length;
    if (!strcmp(v->unit, "K") && value + KELVIN >= v->minimum && value + KELVIN <= v->maximum)
        length += snprintf(text, size, ". It is given in kelvin: if %g degC is meant, set %g", value, value + KELVIN);
    else if (!strcmp(v->unit, "rad/s"))
        length += snprintf(text, size, ". It is given in rad/s: if 1/min is meant, multiply by pi/30");
    return length;
}

/* The faults of all settable values, after a ramp of `duration`, in model.message. */
static void describe_faults(Instance *self, double duration) {
    char *text = self->model.message;
    size_t left = MESSAGE_SIZE;
    text[0] = '\0';
    for (unsigned i = 0; i < model_variable_count && left > 8; i++) {
        const double value = self->values[i] + self->slopes[i] * duration;
        int length = 0;
        if (usable(&model_variables[i], value)) continue;
        if (text != self->model.message) length = snprintf(text, left, "; ");
        length += describe(&model_variables[i], value, text + length, left - (size_t)length);
        length = length < 0 ? 0 : (size_t)length < left ? length : (int)left - 1;
        text += length, left -= (size_t)length;
    }
}

void count_faults(Instance *self) {
    self->faults = 0;
    for (unsigned i = 0; i < model_variable_count; i++)
        self->faults += !usable(&model_variables[i], self->values[i]);
}

static int ramps_stay_usable(const Instance *self, double duration) {
    if (!self->ramping) return 1;
    for (unsigned i = 0; i < model_variable_count; i++)
        if (!usable(&model_variables[i], self->values[i] + self->slopes[i] * duration)) return 0;
    return 1;
}

/* ---------------------------------------------------------------------------------------------- life of an instance */

static void to_start(Instance *self) {
    for (unsigned i = 0; i < model_variable_count; i++) {
        self->values[i] = model_variables[i].start;
        self->slopes[i] = 0.0;
    }
    memset(self->model.state, 0, model_state_size);
    self->model.time = 0.0;
    self->model.changed = CHANGED_INPUTS | CHANGED_PARAMETERS | CHANGED_STATE;
    self->mode = INSTANTIATED;
    self->experiment = self->fresh = self->blank = self->ramping = 0;
    self->last_step = fmi2OK;
    self->complained[0] = '\0';
    count_faults(self);
}

static size_t in_doubles(size_t bytes) { return (bytes + sizeof(double) - 1) / sizeof(double) * sizeof(double); }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    const size_t values = model_variable_count * sizeof(double), state = in_doubles(model_state_size);
    const size_t scratch = in_doubles(model_scratch_size), head = in_doubles(sizeof(Instance));
    const char *fault = NULL;
    fmi2CallbackFreeMemory release = free;
    Instance *self;
    char *memory;
    (void)fmuResourceLocation, (void)visible; /* everything is inside the binary */
    if (!functions) return NULL;
    if (!instanceName || !*instanceName) fault = "an instance needs a name", instanceName = "";
    else if (fmuType != fmi2CoSimulation) fault = "this FMU is for co-simulation only";
    else if (!fmuGUID || strcmp(fmuGUID, model_guid))
        fault = "the GUID is not that of this binary; its modelDescription.xml belongs to another build";
    if (fault) {
        tell(functions, instanceName, fmi2Error, fault);
        return NULL;
    }
    if (functions->allocateMemory && functions->freeMemory) {
        memory = functions->allocateMemory(1, head + 2 * values + state + scratch + strlen(instanceName) + 1);
        release = functions->freeMemory;
    } else {
        memory = calloc(1, head + 2 * values + state + scratch + strlen(instanceName) + 1);
    }
    if (!memory) {
        tell(functions, instanceName, fmi2Error, "there is no memory for an instance");
        return NULL;
    }
    memset(memory, 0, head + 2 * values + state + scratch); /* not every host's allocateMemory clears it */
    self = (Instance *)memory;
    self->callbacks = *functions;
    self->release = release;
    self->logged = loggingOn ? EVERY_STATUS : FAILURES;
    self->values = (double *)(memory += head);
    self->slopes = (double *)(memory += values);
    self->model.state = memory += values;
    self->model.scratch = memory += state;
    self->name = strcpy(memory + scratch, instanceName);
    self->model.values = self->values;
    self->model.slopes = self->slopes;
    to_start(self);
    return self;
}

void fmi2FreeInstance(fmi2Component c) {
    Instance *self = c;
    if (self) self->release(self);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    Instance *self = c;
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime; /* they do not matter here */
    if (!allowed(self, INSTANTIATED, "fmi2SetupExperiment")) return fmi2Error;
    if (!isfinite(startTime))
        return report(self, fmi2Error, "the simulation cannot start at %g s; a finite time is needed", startTime);
    self->model.time = startTime;
    self->experiment = 1;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Instance *self = c;
    if (!allowed(self, INSTANTIATED, "fmi2EnterInitializationMode")) return fmi2Error;
    if (!self->experiment)
        return report(self, fmi2Error, "fmi2EnterInitializationMode is not allowed before fmi2SetupExperiment");
    self->mode = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Instance *self = c;
    ModelStatus status = MODEL_REFUSED;
    if (!allowed(self, INITIALIZATION, "fmi2ExitInitializationMode")) return fmi2Error;
    if (self->faults) describe_faults(self, 0.0);
    else status = model_start(&self->model);
    self->fresh = 0;
    if (status == MODEL_BROKEN) self->mode = BROKEN;
    if (status >= MODEL_REFUSED)
        return report(self, fmi2Error, "the initialization cannot end: %s", self->model.message);
    self->mode = STEP_COMPLETE;
    /* Told, but not returned: there are hosts that take all but fmi2OK for a failed initialization. */
    if (status == MODEL_WARNING) report(self, fmi2Warning, "%s", self->model.message);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Instance *self = c;
    if (!allowed(self, STEPPING, "fmi2Terminate")) return fmi2Error;
    self->mode = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    Instance *self = c;
    if (!allowed(self, ANY, "fmi2Reset")) return fmi2Error;
    to_start(self);
    return fmi2OK;
}

fmi2String fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2String fmi2GetVersion(void) { return fmi2Version; }

/* ----------------------------------------------------------------------------------------------------------- values */

static const char *const TYPE_NAMES[] = {"Real", "Integer", "Boolean"};

static int known(Instance *self, const fmi2ValueReference vr[], size_t nvr, const void *value, VariableType type,
                 const char *function) {
    if (nvr && (!vr || !value)) {
        report(self, fmi2Error, "%s: an array is NULL", function);
        return 0;
    }
    for (size_t i = 0; i < nvr; i++) {
        if (vr[i] >= model_variable_count)
            report(self, fmi2Error, "%s: there is no variable with value reference %u", function, vr[i]);
        else if (model_variables[vr[i]].type != type)
            report(self, fmi2Error, "%s: %s is of type %s, not %s", function, model_variables[vr[i]].name,
                   TYPE_NAMES[model_variables[vr[i]].type], TYPE_NAMES[type]);
        else continue;
        return 0;
    }
    return 1;
}

/* Bring the calculated values up to this moment; where there are none they are NaN, and why is told once. */
static fmi2Status refresh(Instance *self) {
    Model *model = &self->model;
    ModelStatus status = MODEL_REFUSED;
    if (self->fresh) return self->blank ? fmi2Warning : fmi2OK;
    if (self->faults) describe_faults(self, 0.0);
    else status = model_outputs(model);
    self->fresh = 1;
    self->blank = status >= MODEL_REFUSED;
    if (!self->blank) return fmi2OK;
    for (unsigned i = 0; i < model_variable_count; i++)
        if (model_variables[i].access == CALCULATED) self->values[i] = model_variables[i].type == REAL ? NAN : 0.0;
    if (strcmp(model->message, self->complained)) {
        strcpy(self->complained, model->message);
        report(self, fmi2Warning, "outputs have no value: %s", model->message);
    }
    return fmi2Warning;
}

static fmi2Status ready_to_get(Instance *self, const fmi2ValueReference vr[], size_t nvr, const void *value,
                               VariableType type, const char *function) {
    if (!allowed(self, ANY, function) || !known(self, vr, nvr, value, type, function)) return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        if (model_variables[vr[i]].access != CALCULATED) continue;
        if (self->mode & (INSTANTIATED | BROKEN))
            return report(self, fmi2Error, "%s: %s has no value %s", function, model_variables[vr[i]].name,
                          mode_text(self->mode));
        return refresh(self);
    }
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    const fmi2Status status = ready_to_get(c, vr, nvr, value, REAL, "fmi2GetReal");
    for (size_t i = 0; status <= fmi2Warning && i < nvr; i++) value[i] = ((Instance *)c)->values[vr[i]];
    return status;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    const fmi2Status status = ready_to_get(c, vr, nvr, value, INTEGER, "fmi2GetInteger");
    for (size_t i = 0; status <= fmi2Warning && i < nvr; i++) value[i] = (fmi2Integer)((Instance *)c)->values[vr[i]];
    return status;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    const fmi2Status status = ready_to_get(c, vr, nvr, value, BOOLEAN, "fmi2GetBoolean");
    for (size_t i = 0; status <= fmi2Warning && i < nvr; i++) value[i] = ((Instance *)c)->values[vr[i]] != 0.0;
    return status;
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    (void)vr, (void)value;
    if (!allowed(c, ANY, "fmi2GetString")) return fmi2Error;
    return nvr ? report(c, fmi2Error, "fmi2GetString: there are no variables of type String") : fmi2OK;
}

static int ready_to_set(Instance *self, const fmi2ValueReference vr[], size_t nvr, const void *value, VariableType type,
                        const char *function) {
    if (!allowed(self, INSTANTIATED | INITIALIZATION | STEPPING, function)) return 0;
    if (!known(self, vr, nvr, value, type, function)) return 0;
    for (size_t i = 0; i < nvr; i++) {
        const Variable *variable = &model_variables[vr[i]];
        if (variable->access == CALCULATED)
            report(self, fmi2Error, "%s is calculated and cannot be set", variable->name);
        else if (variable->access == FIXED && self->mode & STEPPING)
            report(self, fmi2Error, "%s can be set before the simulation starts only; it stays as it was",
                   variable->name);
        else continue;
        return 0;
    }
    return 1;
}

/* Whether a value can be used is judged when it is: a host may set several that only fit together. */
static void put(Instance *self, fmi2ValueReference vr, double value) {
    const Variable *variable = &model_variables[vr];
    self->slopes[vr] = 0.0;
    if (value == self->values[vr]) return;
    self->faults += (unsigned)!usable(variable, value) - (unsigned)!usable(variable, self->values[vr]);
    self->values[vr] = value;
    self->model.changed |= variable->access == INPUT ? CHANGED_INPUTS : CHANGED_PARAMETERS;
    self->fresh = 0;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    if (!ready_to_set(c, vr, nvr, value, REAL, "fmi2SetReal")) return fmi2Error;
    for (size_t i = 0; i < nvr; i++) put(c, vr[i], value[i]);
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    if (!ready_to_set(c, vr, nvr, value, INTEGER, "fmi2SetInteger")) return fmi2Error;
    for (size_t i = 0; i < nvr; i++) put(c, vr[i], value[i]);
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    if (!ready_to_set(c, vr, nvr, value, BOOLEAN, "fmi2SetBoolean")) return fmi2Error;
    for (size_t i = 0; i < nvr; i++) put(c, vr[i], value[i] != fmi2False);
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    (void)vr, (void)value;
    if (!allowed(c, INSTANTIATED | INITIALIZATION | STEPPING, "fmi2SetString")) return fmi2Error;
    return nvr ? report(c, fmi2Error, "fmi2SetString: there are no variables of type String") : fmi2OK;
}

/* Rates of inputs during the next step; setting an input holds it again. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    static const char function[] = "fmi2SetRealInputDerivatives";
    Instance *self = c;
    if (!allowed(self, INITIALIZATION | STEPPING, function)) return fmi2Error;
    if (!known(self, vr, nvr, order && value ? value : NULL, REAL, function)) return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        if (model_variables[vr[i]].access != INPUT)
            return report(self, fmi2Error, "%s: %s is no input", function, model_variables[vr[i]].name);
        if (order[i] != 1) return report(self, fmi2Error, "%s: order %d; 1 is possible", function, (int)order[i]);
        if (!isfinite(value[i]))
            return report(self, fmi2Error, "%s: %s changes by %g per s; a finite number is needed", function,
                          model_variables[vr[i]].name, value[i]);
    }
    for (size_t i = 0; i < nvr; i++) self->slopes[vr[i]] = value[i];
    self->ramping = 1;
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)order, (void)value;
    if (!allowed(c, ANY, "fmi2GetRealOutputDerivatives")) return fmi2Error;
    return nvr ? report(c, fmi2Error, "fmi2GetRealOutputDerivatives: outputs have no derivatives here") : fmi2OK;
}

/* ------------------------------------------------------------------------------------------------------------ steps */

static fmi2Status refuse_step(Instance *self, const char *why) {
    return report(self, fmi2Discard, "step refused, state unchanged: %s", why);
}

static fmi2Status step(Instance *self, double time, double duration) {
    Model *model = &self->model;
    char *text = model->message;
    ModelStatus status;
    if (!isfinite(time) || !isfinite(duration))
        snprintf(text, MESSAGE_SIZE, "a step from %g s of %g s is not possible; finite times are needed", time,
                 duration);
    else if (!(duration > 0.0 && duration <= LONGEST_STEP_S))
        snprintf(text, MESSAGE_SIZE, "a step of %g s is not possible; above 0 and up to %g s is", duration,
                 LONGEST_STEP_S);
    else if (fabs(time - model->time) > TIME_TOLERANCE * fmax(fmax(1.0, fabs(time)), duration))
        snprintf(text, MESSAGE_SIZE, "the step starts at %g s, but the last one ended at %g s; "
                 "to go back, restore an FMU state saved there", time, model->time);
    else if (self->faults) describe_faults(self, 0.0);
    else if (!ramps_stay_usable(self, duration)) describe_faults(self, duration);
    else {
        const double before = model->time;
        model->time = time;
        status = model_step(model, duration);
        if (status >= MODEL_REFUSED) model->time = before;
        if (status == MODEL_REFUSED) return refuse_step(self, text);
        self->fresh = 0;
        if (status == MODEL_BROKEN) {
            self->mode = BROKEN;
            return report(self, fmi2Error, "%s", text);
        }
        model->time = time + duration;
        if (self->ramping) memset(self->slopes, 0, model_variable_count * sizeof(double));
        self->ramping = 0;
        self->complained[0] = '\0';
        return status == MODEL_WARNING ? report(self, fmi2Warning, "%s", text) : fmi2OK;
    }
    return refuse_step(self, text);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    Instance *self = c;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!allowed(self, STEPPING, "fmi2DoStep")) return fmi2Error;
    self->last_step = step(self, currentCommunicationPoint, communicationStepSize);
    if (self->mode != BROKEN) self->mode = self->last_step == fmi2Discard ? STEP_FAILED : STEP_COMPLETE;
    return self->last_step;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    if (!allowed(c, ANY, "fmi2CancelStep")) return fmi2Error;
    return report(c, fmi2Error, "fmi2CancelStep: there is no step to cancel; steps end before fmi2DoStep returns");
}

static fmi2Status status_fault(Instance *self, const char *function, const void *value) {
    if (!allowed(self, ANY, function)) return fmi2Error;
    if (!value) return report(self, fmi2Error, "%s: value is NULL", function);
    return report(self, fmi2Discard, "%s: that status is not known", function);
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    if (!c || !value || s != fmi2DoStepStatus) return status_fault(c, "fmi2GetStatus", value);
    *value = ((Instance *)c)->last_step;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    if (!c || !value || s != fmi2LastSuccessfulTime) return status_fault(c, "fmi2GetRealStatus", value);
    *value = ((Instance *)c)->model.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    return status_fault(c, "fmi2GetIntegerStatus", value);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    if (!c || !value || s != fmi2Terminated) return status_fault(c, "fmi2GetBooleanStatus", value);
    /* After a refused step: a host that does not correct what was refused must end, or it tries the same for ever. */
    *value = ((Instance *)c)->last_step == fmi2Discard;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    (void)s;
    return status_fault(c, "fmi2GetStringStatus", value);
}
