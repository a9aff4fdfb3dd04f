/* Log, life, values and steps of an instance. Saved states and derivatives: instance_state.c. */
#include "instance.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define LONGEST_STEP_S 1e9
#define BOUND_TOLERANCE 1e-9 /* a bound converted from another unit, or reached by a ramp, is a rounding off */
#define KELVIN 273.15

/* The host's clock and ours may differ by a small part of a step and by the rounding of the time, so that a step that is
   repeated or left out is seen however late it is. The host's clock is taken over, so differences do not add up. */
#define CLOCK_SLIP 1e-3
#define CLOCK_ROUNDING (16.0 * DBL_EPSILON)

/* -------------------------------------------------------------------------------------------------------------- log */

static const char *const CATEGORIES[] = {"", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                         "logStatusFatal"};
#define EVERY_STATUS (ONLY(STATUS_WARNING) | ONLY(STATUS_DISCARD) | ONLY(STATUS_ERROR) | ONLY(STATUS_FATAL))
#define FAILURES (EVERY_STATUS & ~ONLY(STATUS_WARNING)) /* without these a host could not say why it stopped */

static void write_log(const Host *host, const char *name, Status status, const char *text) {
    if (host->logger) host->write(host, name, status, CATEGORIES[status], text);
}

Status instance_report(Instance *self, Status status, const char *format, ...) {
    if (self->logged & ONLY(status)) {
        char text[MESSAGE_SIZE + 128];
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        write_log(&self->host, self->name, status, text);
    }
    return status;
}

static const char *mode_text(Mode mode) {
    switch (mode) {
    case INSTANTIATED: return "before the initialization";
    case INITIALIZATION: return "in initialization mode";
    case STEP_COMPLETE: return "after the initialization";
    case STEP_FAILED: return "after a refused step";
    default: return "after the end of the simulation";
    }
}

int instance_allows(Instance *self, unsigned modes, const char *function) {
    if (!self) return 0;
    if (modes & ONLY(self->mode)) return 1;
    instance_report(self, STATUS_ERROR, "%s is not allowed %s", function, mode_text(self->mode));
    return 0;
}

/* The statuses of a log category; 0 if there is none of that name. */
static unsigned statuses_of(const char *category) {
    if (!category) return 0;
    if (!strcmp(category, "logAll")) return EVERY_STATUS;
    for (unsigned status = STATUS_WARNING; status <= STATUS_FATAL; status++)
        if (!strcmp(category, CATEGORIES[status])) return ONLY(status);
    return 0;
}

Status instance_set_logging(Instance *self, int on, size_t count, const char *const categories[],
                            const char *function) {
    unsigned chosen = count ? 0 : EVERY_STATUS;
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (count && !categories) return instance_report(self, STATUS_ERROR, "%s: categories is NULL", function);
    for (size_t i = 0; i < count; i++) {
        const unsigned found = statuses_of(categories[i]);
        if (!found)
            return instance_report(self, STATUS_ERROR, "there is no log category '%s'",
                                   categories[i] ? categories[i] : "NULL");
        chosen |= found;
    }
    self->logged = on ? chosen : self->logged & ~chosen;
    return STATUS_OK;
}

/* ---------------------------------------------------------------------------------------------------- usable values */

static int usable(const Variable *variable, double value) {
    const double slack = BOUND_TOLERANCE * fmax(1.0, fabs(value));
    return variable->access == CALCULATED
        || (isfinite(value) && value >= variable->minimum - slack && value <= variable->maximum + slack);
}

/* Add why a value cannot be used, and what was probably meant. */
static void describe(const Variable *v, double value, char *message) {
    const char *unit = strcmp(v->unit, "1") ? v->unit : "";
    const char *space = *unit ? " " : "";
    if (!isfinite(value)) {
        append(message, "%s is %g; a finite number is needed", v->name, value);
        return;
    }
    append(message, "%s is %g%s%s; %g to %g%s%s is possible", v->name, value, space, unit, v->minimum, v->maximum,
           space, unit);
    if (!strcmp(v->unit, "K") && value + KELVIN >= v->minimum && value + KELVIN <= v->maximum)
        append(message, ". It is given in kelvin: if %g degC is meant, set %g", value, value + KELVIN);
    else if (!strcmp(v->unit, "rad/s"))
        append(message, ". It is given in rad/s: if 1/min is meant, multiply by pi/30");
}

/* The faults of all settable values, after a ramp of `duration`, in model.message. */
static void describe_faults(Instance *self, double duration) {
    char *message = self->model.message;
    message[0] = '\0';
    for (unsigned i = 0; i < model_variable_count; i++) {
        const double value = self->values[i] + self->slopes[i] * duration;
        if (usable(&model_variables[i], value)) continue;
        if (*message) append(message, "; ");
        describe(&model_variables[i], value, message);
    }
}

void instance_count_faults(Instance *self) {
    self->faults = 0;
    for (unsigned i = 0; i < model_variable_count; i++)
        if (!usable(&model_variables[i], self->values[i])) self->faults++;
}

static int ramps_stay_usable(const Instance *self, double duration) {
    if (!self->ramping) return 1;
    for (unsigned i = 0; i < model_variable_count; i++)
        if (!usable(&model_variables[i], self->values[i] + self->slopes[i] * duration)) return 0;
    return 1;
}

/* ------------------------------------------------------------------------------------------------------------- life */

static void to_start(Instance *self) {
    for (unsigned i = 0; i < model_variable_count; i++) {
        self->values[i] = model_variables[i].start;
        self->slopes[i] = 0.0;
    }
    memset(self->model.state, 0, model_state_size);
    self->model.time = 0.0;
    self->model.changed = 1;
    self->mode = INSTANTIATED;
    self->set_up = 0;
    self->stop = INFINITY;
    self->fresh = 0;
    self->blank = 0;
    self->ramping = 0;
    self->last_step = STATUS_OK;
    self->complained[0] = '\0';
    instance_count_faults(self);
}

/* Number of doubles that take as much room. */
static size_t in_doubles(size_t bytes) { return (bytes + sizeof(double) - 1) / sizeof(double); }

Instance *instance_create(const Host *host, const char *name, const char *token, int logging) {
    const size_t head = in_doubles(sizeof(Instance));
    const size_t state = in_doubles(model_state_size);
    const size_t cleared = head + 2 * model_variable_count + state + in_doubles(model_scratch_size);
    Instance *self;
    double *memory;
    if (!name || !*name) {
        write_log(host, "", STATUS_ERROR, "an instance needs a name");
        return NULL;
    }
    if (!token || strcmp(token, model_guid)) {
        write_log(host, name, STATUS_ERROR,
                  "the GUID is not that of this binary; its modelDescription.xml belongs to another build");
        return NULL;
    }
    memory = host->allocate(cleared + in_doubles(strlen(name) + 1), sizeof(double));
    if (!memory) {
        write_log(host, name, STATUS_ERROR, "there is no memory for an instance");
        return NULL;
    }
    memset(memory, 0, cleared * sizeof(double)); /* not every host's function clears it */
    self = (Instance *)memory;
    self->host = *host;
    self->logged = logging ? EVERY_STATUS : FAILURES;
    self->values = memory + head;
    self->slopes = self->values + model_variable_count;
    self->model.state = self->slopes + model_variable_count;
    self->model.scratch = self->slopes + model_variable_count + state;
    self->name = strcpy((char *)(memory + cleared), name);
    self->model.values = self->values;
    self->model.slopes = self->slopes;
    to_start(self);
    return self;
}

void instance_free(Instance *self) {
    if (self) self->host.release(self);
}

Status instance_set_up(Instance *self, double start, double stop, const char *function) {
    if (!instance_allows(self, ONLY(INSTANTIATED), function)) return STATUS_ERROR;
    if (!isfinite(start))
        return instance_report(self, STATUS_ERROR, "the simulation cannot start at %g s; a finite time is needed",
                               start);
    self->model.time = start;
    self->stop = stop;
    self->set_up = 1;
    return STATUS_OK;
}

Status instance_enter_initialization(Instance *self, const char *function) {
    if (!instance_allows(self, ONLY(INSTANTIATED), function)) return STATUS_ERROR;
    if (!self->set_up)
        return instance_report(self, STATUS_ERROR, "%s is not allowed before the experiment is set up", function);
    self->mode = INITIALIZATION;
    return STATUS_OK;
}

Status instance_exit_initialization(Instance *self, const char *function) {
    ModelStatus status = MODEL_REFUSED;
    if (!instance_allows(self, ONLY(INITIALIZATION), function)) return STATUS_ERROR;
    if (self->faults) describe_faults(self, 0.0);
    else status = model_start(&self->model);
    self->fresh = 0;
    if (status == MODEL_REFUSED)
        return instance_report(self, STATUS_ERROR, "the initialization cannot end: %s", self->model.message);
    self->mode = STEP_COMPLETE;
    /* Logged, but not returned: there are hosts that take all but OK for a failed initialization. */
    if (status == MODEL_WARNING) instance_report(self, STATUS_WARNING, "%s", self->model.message);
    return STATUS_OK;
}

Status instance_terminate(Instance *self, const char *function) {
    if (!instance_allows(self, STEPPING, function)) return STATUS_ERROR;
    self->mode = TERMINATED;
    return STATUS_OK;
}

Status instance_reset(Instance *self, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    to_start(self);
    return STATUS_OK;
}

/* ----------------------------------------------------------------------------------------------------------- values */

static const char *const TYPE_NAMES[] = {"real number", "Boolean"};

static int known(Instance *self, const unsigned references[], size_t count, const void *array, VariableType type,
                 const char *function) {
    if (count && (!references || !array)) {
        instance_report(self, STATUS_ERROR, "%s: an array is NULL", function);
        return 0;
    }
    for (size_t i = 0; i < count; i++) {
        const Variable *variable;
        if (references[i] >= model_variable_count) {
            instance_report(self, STATUS_ERROR, "%s: there is no variable with value reference %u", function,
                            references[i]);
            return 0;
        }
        variable = &model_variables[references[i]];
        if (variable->type != type) {
            instance_report(self, STATUS_ERROR, "%s: %s is a %s, not a %s", function, variable->name,
                            TYPE_NAMES[variable->type], TYPE_NAMES[type]);
            return 0;
        }
    }
    return 1;
}

/* Bring the calculated values up to this moment; where there are none they are NaN, and why is logged once. */
static Status refresh(Instance *self) {
    Model *model = &self->model;
    ModelStatus status = MODEL_REFUSED;
    if (self->fresh) return self->blank ? STATUS_WARNING : STATUS_OK;
    if (self->faults) describe_faults(self, 0.0);
    else status = model_outputs(model);
    self->fresh = 1;
    self->blank = status == MODEL_REFUSED;
    if (!self->blank) return STATUS_OK;
    for (unsigned i = 0; i < model_variable_count; i++)
        if (model_variables[i].access == CALCULATED) self->values[i] = model_variables[i].type == REAL ? NAN : 0.0;
    if (strcmp(model->message, self->complained)) {
        strcpy(self->complained, model->message);
        instance_report(self, STATUS_WARNING, "outputs have no value: %s", model->message);
    }
    return STATUS_WARNING;
}

Status instance_prepare_get(Instance *self, const unsigned references[], size_t count, const void *array,
                            VariableType type, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (!known(self, references, count, array, type, function)) return STATUS_ERROR;
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = &model_variables[references[i]];
        if (variable->access != CALCULATED) continue;
        if (self->mode == INSTANTIATED)
            return instance_report(self, STATUS_ERROR, "%s: %s has no value %s", function, variable->name,
                                   mode_text(self->mode));
        return refresh(self);
    }
    return STATUS_OK;
}

Status instance_prepare_set(Instance *self, const unsigned references[], size_t count, const void *array,
                            VariableType type, const char *function) {
    if (!instance_allows(self, STARTING | STEPPING, function)) return STATUS_ERROR;
    if (!known(self, references, count, array, type, function)) return STATUS_ERROR;
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = &model_variables[references[i]];
        if (variable->access == CALCULATED)
            return instance_report(self, STATUS_ERROR, "%s is calculated and cannot be set", variable->name);
        if (variable->access == FIXED && (ONLY(self->mode) & STEPPING))
            return instance_report(self, STATUS_ERROR,
                                   "%s can be set before the simulation starts only; it stays as it was",
                                   variable->name);
    }
    return STATUS_OK;
}

/* A value is judged when it is used, not here: a host may set several that only fit together. */
void instance_put(Instance *self, unsigned reference, double value) {
    const Variable *variable = &model_variables[reference];
    if (value == self->values[reference]) return;
    if (!usable(variable, self->values[reference])) self->faults--;
    if (!usable(variable, value)) self->faults++;
    self->values[reference] = value;
    if (variable->access != INPUT) self->model.changed = 1;
    self->fresh = 0;
}

Status instance_without(Instance *self, size_t count, const char *type, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    return count ? instance_report(self, STATUS_ERROR, "%s: there are no variables of type %s", function, type)
                 : STATUS_OK;
}

Status instance_set_rates(Instance *self, const unsigned references[], size_t count, const int orders[],
                          const double rates[], const char *function) {
    if (!instance_allows(self, STARTING | STEPPING, function)) return STATUS_ERROR;
    if (!known(self, references, count, orders ? rates : NULL, REAL, function)) return STATUS_ERROR;
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = &model_variables[references[i]];
        if (variable->access != INPUT)
            return instance_report(self, STATUS_ERROR, "%s: %s is no input", function, variable->name);
        if (orders[i] != 1)
            return instance_report(self, STATUS_ERROR, "%s: order %d; 1 is possible", function, orders[i]);
        if (!isfinite(rates[i]))
            return instance_report(self, STATUS_ERROR, "%s: %s changes by %g per s; a finite number is needed",
                                   function, variable->name, rates[i]);
    }
    for (size_t i = 0; i < count; i++) self->slopes[references[i]] = rates[i];
    self->ramping = 1;
    return STATUS_OK;
}

/* ------------------------------------------------------------------------------------------------------------ steps */

/* Leave model.message empty if a step can be tried, else say why not. */
static void judge_step(Instance *self, double time, double duration) {
    char *text = self->model.message;
    const double own = self->model.time;
    text[0] = '\0';
    if (!isfinite(time) || !isfinite(duration))
        append(text, "a step from %g s of %g s is not possible; finite times are needed", time, duration);
    else if (!(duration > 0.0 && duration <= LONGEST_STEP_S))
        append(text, "a step of %g s is not possible; above 0 and up to %g s is", duration, LONGEST_STEP_S);
    else if (fabs(time - own) > CLOCK_SLIP * duration + CLOCK_ROUNDING * fabs(time))
        append(text, "the step starts at %.15g s, but the last one ended at %.15g s; "
               "to go back, restore an FMU state saved there", time, own);
    else if (self->faults) describe_faults(self, 0.0);
    else if (!ramps_stay_usable(self, duration)) describe_faults(self, duration);
}

static Status try_step(Instance *self, double time, double duration) {
    Model *model = &self->model;
    const double before = model->time;
    ModelStatus status = MODEL_REFUSED;
    judge_step(self, time, duration);
    if (!model->message[0]) {
        model->time = time;
        status = model_step(model, duration);
    }
    if (status == MODEL_REFUSED) {
        model->time = before;
        return instance_report(self, STATUS_DISCARD, "step refused, state unchanged: %s", model->message);
    }
    self->fresh = 0;
    model->time = time + duration;
    if (self->ramping) memset(self->slopes, 0, model_variable_count * sizeof(double));
    self->ramping = 0;
    self->complained[0] = '\0';
    return status == MODEL_WARNING ? instance_report(self, STATUS_WARNING, "%s", model->message) : STATUS_OK;
}

Status instance_step(Instance *self, double time, double duration, const char *function) {
    if (!instance_allows(self, STEPPING, function)) return STATUS_ERROR;
    if (time + duration > self->stop + CLOCK_SLIP * duration + CLOCK_ROUNDING * fabs(self->stop))
        return instance_report(self, STATUS_ERROR, "%s: the step would end at %.15g s, past the stop time of %.15g s",
                               function, time + duration, self->stop);
    self->last_step = try_step(self, time, duration);
    self->mode = self->last_step == STATUS_DISCARD ? STEP_FAILED : STEP_COMPLETE;
    return self->last_step;
}
