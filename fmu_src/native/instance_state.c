/* Saved and serialized states of an instance, and derivatives. */
#include "instance.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* ----------------------------------------------------------------------------------------------------- saved states */

/* A saved state: this head, all values and slopes, the model's state. Every member has 8 bytes, so that the layout is
   the same on all platforms. */
typedef struct {
    char magic[8];
    char guid[64];
    uint64_t size;     /* of everything, in bytes */
    uint64_t checksum; /* of everything, made when the state is serialized */
    uint64_t mode;
    uint64_t set_up;
    uint64_t last_step;
    double time;
} SavedState;

static const char MAGIC[8] = {'F', 'M', 'U', 'S', 'T', 'A', '0', '2'};

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
    if (!saved) return "it is NULL";
    if (memcmp(saved->magic, MAGIC, sizeof MAGIC)) return "it is not a saved state of such an FMU";
    if (strncmp(saved->guid, model_guid, sizeof saved->guid)) return "it was saved by another FMU";
    if (saved->size != saved_size()) return "its size is not that of this FMU's states";
    if (saved->mode > TERMINATED) return "it is damaged";
    return NULL;
}

/* Room for a state at *state, which may hold one already. */
static SavedState *room_for_state(Instance *self, void **state, const char *function) {
    SavedState *saved = state ? *state : NULL;
    if (!state || (saved && foreign(saved))) {
        instance_report(self, STATUS_ERROR, "%s: the state must point to NULL or to a state of this FMU", function);
        return NULL;
    }
    if (saved) return saved;
    saved = self->host.allocate(1, saved_size());
    if (!saved) instance_report(self, STATUS_ERROR, "%s: there is no memory for a state", function);
    return saved;
}

Status instance_save(Instance *self, void **state, const char *function) {
    SavedState *saved;
    double *values;
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    saved = room_for_state(self, state, function);
    if (!saved) return STATUS_ERROR;
    memset(saved, 0, sizeof *saved);
    memcpy(saved->magic, MAGIC, sizeof MAGIC);
    strncpy(saved->guid, model_guid, sizeof saved->guid - 1);
    saved->size = saved_size();
    saved->mode = self->mode;
    saved->set_up = (uint64_t)self->set_up;
    saved->last_step = self->last_step;
    saved->time = self->model.time;
    values = (double *)(saved + 1);
    for (unsigned i = 0; i < model_variable_count; i++) /* what is calculated will be calculated again */
        values[i] = model_variables[i].access == CALCULATED ? 0.0 : self->values[i];
    memcpy(values + model_variable_count, self->slopes, model_variable_count * sizeof(double));
    memcpy(values + 2 * model_variable_count, self->model.state, model_state_size);
    *state = saved;
    return STATUS_OK;
}

Status instance_restore(Instance *self, const void *state, const char *function) {
    const SavedState *saved = state;
    const char *fault = foreign(saved);
    const double *values;
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (fault) return instance_report(self, STATUS_ERROR, "the state cannot be restored: %s", fault);
    values = (const double *)(saved + 1);
    self->mode = (Mode)saved->mode;
    self->set_up = (int)saved->set_up;
    self->last_step = (Status)saved->last_step;
    self->model.time = saved->time;
    memcpy(self->values, values, model_variable_count * sizeof(double));
    memcpy(self->slopes, values + model_variable_count, model_variable_count * sizeof(double));
    memcpy(self->model.state, values + 2 * model_variable_count, model_state_size);
    self->model.changed = 1;
    self->fresh = 0;
    self->blank = 0;
    self->ramping = 1;
    self->complained[0] = '\0';
    instance_count_faults(self);
    return STATUS_OK;
}

Status instance_free_state(Instance *self, void **state, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (!state || !*state) return STATUS_OK;
    if (foreign(*state)) return instance_report(self, STATUS_ERROR, "%s: it is no state of this FMU", function);
    memset(*state, 0, sizeof(SavedState)); /* a second free of the same state is then noticed more often than not */
    self->host.release(*state);
    *state = NULL;
    return STATUS_OK;
}

Status instance_serialized_size(Instance *self, const void *state, size_t *size, const char *function) {
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (!size || foreign(state))
        return instance_report(self, STATUS_ERROR, "%s: it is no state of this FMU, or size is NULL", function);
    *size = saved_size();
    return STATUS_OK;
}

Status instance_serialize(Instance *self, const void *state, void *bytes, size_t size, const char *function) {
    uint64_t sum;
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (!bytes || foreign(state))
        return instance_report(self, STATUS_ERROR, "%s: it is no state of this FMU, or the bytes are NULL", function);
    if (size < saved_size())
        return instance_report(self, STATUS_ERROR, "%s: %lu bytes are too few; %lu are needed", function,
                               (unsigned long)size, (unsigned long)saved_size());
    memcpy(bytes, state, saved_size());
    sum = checksum(bytes, saved_size());
    memcpy((char *)bytes + offsetof(SavedState, checksum), &sum, sizeof sum); /* it may not be aligned */
    return STATUS_OK;
}

/* Why bytes are no serialized state of this FMU, or NULL. */
static const char *unreadable(const void *bytes, size_t size) {
    SavedState head;
    const char *fault;
    if (size < saved_size()) return "it is too short";
    memcpy(&head, bytes, sizeof head);
    fault = foreign(&head);
    if (!fault && head.checksum != checksum(bytes, saved_size())) fault = "it is damaged";
    return fault;
}

Status instance_deserialize(Instance *self, const void *bytes, size_t size, void **state, const char *function) {
    const char *fault;
    SavedState *saved;
    if (!instance_allows(self, ANY_MODE, function)) return STATUS_ERROR;
    if (!bytes) return instance_report(self, STATUS_ERROR, "%s: the bytes are NULL", function);
    fault = unreadable(bytes, size);
    if (fault) return instance_report(self, STATUS_ERROR, "the serialized state cannot be read: %s", fault);
    saved = room_for_state(self, state, function);
    if (!saved) return STATUS_ERROR;
    memcpy(saved, bytes, saved_size());
    *state = saved;
    return STATUS_OK;
}

/* ------------------------------------------------------------------------------------------------------ derivatives */

#define RELATIVE_STEP 1e-3 /* of a value: balances rounding with the fourth-order remainder */
#define LEAST_SHARE 1e-3   /* of the nominal value, that a value counts for at least: knees lie near zero */

/* Add the unknowns, weighted, with one known at `value`. */
static Status add_unknowns_at(Instance *self, unsigned known, double value, const unsigned unknowns[],
                              size_t n_unknowns, double weight, double sums[]) {
    self->values[known] = value;
    if (model_variables[known].access != INPUT) self->model.changed = 1;
    if (model_outputs(&self->model) == MODEL_REFUSED) return STATUS_ERROR;
    for (size_t i = 0; i < n_unknowns; i++) sums[i] += weight * self->values[unknowns[i]];
    return STATUS_OK;
}

static Status add_derivatives(Instance *self, unsigned known, double seed, const unsigned unknowns[],
                              size_t n_unknowns, double sums[]) {
    static const double PLACES[] = {1.0, -1.0, 2.0, -2.0};
    static const double WEIGHTS[] = {2.0 / 3.0, -2.0 / 3.0, -1.0 / 12.0, 1.0 / 12.0};
    const Variable *variable = &model_variables[known];
    const double value = self->values[known];
    const double h = RELATIVE_STEP * fmax(fabs(value), LEAST_SHARE * variable->nominal);
    /* Near a bound the places move inside: beyond it a value is held, and the slope would come out too small. */
    double centre = fmax(value, variable->minimum + 2.0 * h);
    Status status = STATUS_OK;
    if (centre > variable->maximum - 2.0 * h) centre = variable->maximum - 2.0 * h;
    for (int i = 0; i < 4 && status == STATUS_OK; i++)
        status = add_unknowns_at(self, known, centre + PLACES[i] * h, unknowns, n_unknowns, WEIGHTS[i] * seed / h, sums);
    self->values[known] = value;
    if (variable->access != INPUT) self->model.changed = 1;
    return status;
}

static Status judge_knowns(Instance *self, const unsigned knowns[], size_t n_knowns, const char *function) {
    for (size_t k = 0; k < n_knowns; k++) {
        const Variable *known = knowns[k] < model_variable_count ? &model_variables[knowns[k]] : NULL;
        if (!known || known->access == CALCULATED || known->type != REAL)
            return instance_report(self, STATUS_ERROR, "%s: known %u is no real input or parameter", function,
                                   knowns[k]);
        if (known->access == FIXED && self->mode != INITIALIZATION)
            return instance_report(self, STATUS_ERROR, "%s: %s is fixed after the initialization", function,
                                   known->name);
    }
    return STATUS_OK;
}

static Status judge_unknowns(Instance *self, const unsigned unknowns[], size_t n_unknowns, const char *function) {
    for (size_t i = 0; i < n_unknowns; i++) {
        const Variable *unknown = unknowns[i] < model_variable_count ? &model_variables[unknowns[i]] : NULL;
        if (!unknown || unknown->access != CALCULATED || unknown->type != REAL)
            return instance_report(self, STATUS_ERROR, "%s: unknown %u is no calculated real number", function,
                                   unknowns[i]);
    }
    return STATUS_OK;
}

/* Central differences of fourth order, one known after the other. */
Status instance_derivatives(Instance *self, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[],
                            size_t n_knowns, const double seed[], double sensitivity[], const char *function) {
    Status status = STATUS_OK;
    if (!instance_allows(self, ONLY(INITIALIZATION) | STEPPING | ONLY(TERMINATED), function)) return STATUS_ERROR;
    if ((n_unknowns && (!unknowns || !sensitivity)) || (n_knowns && (!knowns || !seed)))
        return instance_report(self, STATUS_ERROR, "%s: an array is NULL", function);
    if (judge_unknowns(self, unknowns, n_unknowns, function) != STATUS_OK) return STATUS_ERROR;
    if (judge_knowns(self, knowns, n_knowns, function) != STATUS_OK) return STATUS_ERROR;
    if (self->faults)
        return instance_report(self, STATUS_ERROR, "%s: values cannot be used; correct them first", function);
    for (size_t i = 0; i < n_unknowns; i++) sensitivity[i] = 0.0;
    for (size_t k = 0; k < n_knowns && status == STATUS_OK; k++)
        if (seed[k] != 0.0) status = add_derivatives(self, knowns[k], seed[k], unknowns, n_unknowns, sensitivity);
    self->fresh = 0;
    return status == STATUS_OK ? STATUS_OK
                               : instance_report(self, STATUS_ERROR, "%s: %s", function, self->model.message);
}
