/* FMI 2.0 over any model of model.h: saved and serialized states, directional derivatives. */
#include "fmi2_instance.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* ----------------------------------------------------------------------------------------------------- saved states */

/* A saved state: this head, all values and slopes, the model's state. Every member has 8 bytes, so that the layout is
   the same on all platforms. */
typedef struct {
    char magic[8], guid[64];
    uint64_t size, checksum; /* of everything, in bytes; the checksum is made when the state is serialized */
    uint64_t mode, experiment, last_step;
    double time;
} SavedState;

static const char MAGIC[8] = {'F', 'M', 'U', '2', 'S', 'T', '0', '1'};

static size_t saved_size(void) {
    return sizeof(SavedState) + 2 * model_variable_count * sizeof(double) + model_state_size;
}

/* FNV-1a over the bytes, those of the checksum itself left out. */
static uint64_t checksum(const char *bytes, size_t size) {
    const size_t own = offsetof(SavedState, checksum);
    uint64_t hash = 14695981039346656037u;
    for (size_t i = 0; i < size; i++)
        if (i < own || i >= own + sizeof(uint64_t)) hash = (hash ^ (unsigned char)bytes[i]) * 1099511628211u;
    return hash;
}

/* Why a saved state is none of this FMU's, or NULL. */
static const char *foreign(const SavedState *saved) {
    const uint64_t mode = saved->mode;
    if (memcmp(saved->magic, MAGIC, sizeof MAGIC)) return "it is not a saved state of such an FMU";
    if (strncmp(saved->guid, model_guid, sizeof saved->guid)) return "it was saved by another FMU";
    if (saved->size != saved_size()) return "its size is not that of this FMU's states";
    if (!(mode & ANY & ~(uint64_t)BROKEN) || mode & (mode - 1)) return "it is damaged";
    return NULL;
}

/* Room for a state at *FMUstate, which may hold one already. */
static SavedState *room_for_state(Instance *self, fmi2FMUstate *FMUstate, const char *function) {
    SavedState *saved;
    if (!FMUstate || (*FMUstate && foreign(*FMUstate))) {
        report(self, fmi2Error, "%s: FMUstate must point to NULL or to a state of this FMU", function);
        return NULL;
    }
    if (*FMUstate) return *FMUstate;
    saved = self->release != free ? self->callbacks.allocateMemory(1, saved_size()) : malloc(saved_size());
    if (!saved) report(self, fmi2Error, "%s: there is no memory for a state", function);
    return saved;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *self = c;
    SavedState *saved;
    double *values;
    if (!allowed(self, ANY & ~BROKEN, "fmi2GetFMUstate")) return fmi2Error;
    saved = room_for_state(self, FMUstate, "fmi2GetFMUstate");
    if (!saved) return fmi2Error;
    memset(saved, 0, sizeof *saved);
    memcpy(saved->magic, MAGIC, sizeof MAGIC);
    strncpy(saved->guid, model_guid, sizeof saved->guid - 1);
    saved->size = saved_size();
    saved->mode = self->mode;
    saved->experiment = (uint64_t)self->experiment;
    saved->last_step = self->last_step;
    saved->time = self->model.time;
    values = (double *)(saved + 1);
    for (unsigned i = 0; i < model_variable_count; i++) /* what is calculated will be calculated again */
        values[i] = model_variables[i].access == CALCULATED ? 0.0 : self->values[i];
    memcpy(values + model_variable_count, self->slopes, model_variable_count * sizeof(double));
    memcpy(values + 2 * model_variable_count, self->model.state, model_state_size);
    *FMUstate = saved;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    Instance *self = c;
    const SavedState *saved = FMUstate;
    const double *values = (const double *)(saved + 1);
    const char *fault;
    if (!allowed(self, ANY, "fmi2SetFMUstate")) return fmi2Error;
    fault = saved ? foreign(saved) : "it is NULL";
    if (fault) return report(self, fmi2Error, "the state cannot be restored: %s", fault);
    self->mode = (Mode)saved->mode;
    self->experiment = (int)saved->experiment;
    self->last_step = (fmi2Status)saved->last_step;
    self->model.time = saved->time;
    memcpy(self->values, values, model_variable_count * sizeof(double));
    memcpy(self->slopes, values + model_variable_count, model_variable_count * sizeof(double));
    memcpy(self->model.state, values + 2 * model_variable_count, model_state_size);
    self->model.changed = CHANGED_INPUTS | CHANGED_PARAMETERS | CHANGED_STATE;
    self->fresh = self->blank = 0;
    self->ramping = 1;
    self->complained[0] = '\0';
    count_faults(self);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *self = c;
    if (!allowed(self, ANY, "fmi2FreeFMUstate")) return fmi2Error;
    if (!FMUstate || !*FMUstate) return fmi2OK;
    if (foreign(*FMUstate)) return report(self, fmi2Error, "fmi2FreeFMUstate: it is no state of this FMU");
    memset(*FMUstate, 0, sizeof(SavedState)); /* a second free of the same state is then noticed more often than not */
    self->release(*FMUstate);
    *FMUstate = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    Instance *self = c;
    if (!allowed(self, ANY, "fmi2SerializedFMUstateSize")) return fmi2Error;
    if (!FMUstate || !size || foreign(FMUstate))
        return report(self, fmi2Error, "fmi2SerializedFMUstateSize: it is no state of this FMU, or size is NULL");
    *size = saved_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    Instance *self = c;
    SavedState *written = (SavedState *)serializedState;
    uint64_t sum;
    if (!allowed(self, ANY, "fmi2SerializeFMUstate")) return fmi2Error;
    if (!FMUstate || !written || foreign(FMUstate))
        return report(self, fmi2Error, "fmi2SerializeFMUstate: it is no state of this FMU, or serializedState is NULL");
    if (size < saved_size())
        return report(self, fmi2Error, "fmi2SerializeFMUstate: %lu bytes are too few; %lu are needed",
                      (unsigned long)size, (unsigned long)saved_size());
    memcpy(serializedState, FMUstate, saved_size());
    sum = checksum(serializedState, saved_size());
    memcpy(serializedState + offsetof(SavedState, checksum), &sum, sizeof sum); /* it may not be aligned */
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    Instance *self = c;
    const char *fault = NULL;
    SavedState head, *saved;
    if (!allowed(self, ANY, "fmi2DeSerializeFMUstate")) return fmi2Error;
    if (!serializedState) return report(self, fmi2Error, "fmi2DeSerializeFMUstate: serializedState is NULL");
    if (size < saved_size()) fault = "it is too short";
    if (!fault) {
        memcpy(&head, serializedState, sizeof head);
        fault = foreign(&head);
    }
    if (!fault && head.checksum != checksum(serializedState, saved_size())) fault = "it is damaged";
    if (fault) return report(self, fmi2Error, "the serialized state cannot be read: %s", fault);
    saved = room_for_state(self, FMUstate, "fmi2DeSerializeFMUstate");
    if (!saved) return fmi2Error;
    memcpy(saved, serializedState, saved_size());
    *FMUstate = saved;
    return fmi2OK;
}

/* ------------------------------------------------------------------------------------------------------ derivatives */

#define RELATIVE_STEP 1e-3 /* of a value or its nominal value: balances rounding with the fourth-order remainder */

/* The unknowns with one known value at `value`. */
static fmi2Status unknowns_at(Instance *self, fmi2ValueReference known, double value,
                              const fmi2ValueReference unknown[], size_t count, double found[], double weight) {
    const int is_input = model_variables[known].access == INPUT;
    self->values[known] = value;
    self->model.changed |= is_input ? CHANGED_INPUTS : CHANGED_PARAMETERS;
    if (model_outputs(&self->model) >= MODEL_REFUSED) return fmi2Error;
    for (size_t i = 0; i < count; i++) found[i] += weight * self->values[unknown[i]];
    return fmi2OK;
}

/* Central differences of fourth order, one known after the other, at the present moment and state. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    static const char function[] = "fmi2GetDirectionalDerivative";
    static const double PLACES[] = {1.0, -1.0, 2.0, -2.0}, WEIGHTS[] = {2.0 / 3.0, -2.0 / 3.0, -1.0 / 12.0, 1.0 / 12.0};
    Instance *self = c;
    fmi2Status status = fmi2OK;
    if (!allowed(self, INITIALIZATION | STEPPING | TERMINATED, function)) return fmi2Error;
    if ((nUnknown && (!vUnknown_ref || !dvUnknown)) || (nKnown && (!vKnown_ref || !dvKnown)))
        return report(self, fmi2Error, "%s: an array is NULL", function);
    for (size_t i = 0; i < nUnknown; i++)
        if (vUnknown_ref[i] >= model_variable_count || model_variables[vUnknown_ref[i]].access != CALCULATED
            || model_variables[vUnknown_ref[i]].type != REAL)
            return report(self, fmi2Error, "%s: unknown %u is no calculated Real", function, vUnknown_ref[i]);
    for (size_t k = 0; k < nKnown; k++) {
        const Variable *known = vKnown_ref[k] < model_variable_count ? &model_variables[vKnown_ref[k]] : NULL;
        if (!known || known->access == CALCULATED || known->type != REAL)
            return report(self, fmi2Error, "%s: known %u is no Real input or parameter", function, vKnown_ref[k]);
        if (known->access == FIXED && self->mode != INITIALIZATION)
            return report(self, fmi2Error, "%s: %s is fixed after the initialization", function, known->name);
    }
    if (self->faults) return report(self, fmi2Error, "%s: values cannot be used; correct them first", function);
    for (size_t i = 0; i < nUnknown; i++) dvUnknown[i] = 0.0;
    for (size_t k = 0; k < nKnown && status == fmi2OK; k++) {
        const fmi2ValueReference known = vKnown_ref[k];
        const double value = self->values[known];
        const double h = RELATIVE_STEP * fmax(fabs(value), model_variables[known].nominal);
        for (int i = 0; i < 4 && status == fmi2OK && dvKnown[k] != 0.0; i++)
            status = unknowns_at(self, known, value + PLACES[i] * h, vUnknown_ref, nUnknown, dvUnknown,
                                 WEIGHTS[i] * dvKnown[k] / h);
        self->values[known] = value;
        self->model.changed |= CHANGED_INPUTS | CHANGED_PARAMETERS;
    }
    self->fresh = 0;
    return status == fmi2OK ? fmi2OK : report(self, fmi2Error, "%s: %s", function, self->model.message);
}
