/* One instance of a model and all that FMI does with it, whatever its version: modes, values and their faults, ramps,
   steps, saved states, derivatives, log. The front ends (fmi2_cosimulation.c, fmi3_cosimulation.c) translate types.

   A call that is not allowed, or whose arguments are at fault, returns STATUS_ERROR with a message and changes nothing,
   so that the host may go on. Where values cannot be used, a step is STATUS_DISCARD and outputs are STATUS_WARNING and
   NaN; both work again once the values are corrected. There is no data outside the instances.

   `function` is the name of the FMI function, for messages. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include "linker_names.h"
#include "model.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* numbers of FMI */

typedef enum {
    INSTANTIATED,
    INITIALIZATION,
    STEP_COMPLETE,
    STEP_FAILED, /* the last step was refused; everything is as before it */
    TERMINATED
} Mode;

/* Sets of modes, in which a call is allowed */
#define ONLY(mode) (1u << (mode))
#define STEPPING (ONLY(STEP_COMPLETE) | ONLY(STEP_FAILED))
#define STARTING (ONLY(INSTANTIATED) | ONLY(INITIALIZATION))
#define ANY_MODE (STARTING | STEPPING | ONLY(TERMINATED))

/* The simulation tool: its log and its memory. */
typedef struct Host Host;
struct Host {
    void *environment;
    void (*logger)(void); /* its function, called by `write` with the type that it has in this version of FMI */
    void (*write)(const Host *host, const char *instance, Status status, const char *category, const char *text);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *block);
};

typedef struct {
    Model model;
    Mode mode;
    Host host;
    const char *name;
    unsigned logged;  /* bit ONLY(status): messages of that status are passed on */
    int set_up;       /* the start time is known */
    double stop;      /* no step may end later; infinite if the host named none */
    unsigned faults;  /* how many settable values cannot be used */
    int fresh;        /* the calculated values belong to the present moment */
    int blank;        /* there are none, so they are NaN */
    int ramping;      /* there may be slopes that are not 0 */
    Status last_step;
    double *values;
    double *slopes;
    char complained[MESSAGE_SIZE]; /* the last complaint about values, logged once */
} Instance;

/* ---------------------------------------------------------------------------------------------------- log and life */

/* Log a message and give its status back. */
INTERNAL Status instance_report(Instance *self, Status status, const char *format, ...);

/* True if a call is allowed in the present mode; false, with a message, if not or if there is no instance. */
INTERNAL int instance_allows(Instance *self, unsigned modes, const char *function);

/* A new instance; NULL, with a message, if that is not possible. */
INTERNAL Instance *instance_create(const Host *host, const char *name, const char *token, int logging);
INTERNAL void instance_free(Instance *self);
INTERNAL Status instance_set_logging(Instance *self, int on, size_t count, const char *const categories[],
                                     const char *function);
INTERNAL Status instance_set_up(Instance *self, double start, double stop, const char *function);
INTERNAL Status instance_enter_initialization(Instance *self, const char *function);
INTERNAL Status instance_exit_initialization(Instance *self, const char *function);
INTERNAL Status instance_terminate(Instance *self, const char *function);
INTERNAL Status instance_reset(Instance *self, const char *function);

/* ---------------------------------------------------------------------------------------------------------- values */

/* Make `values` of some variables of a type readable: on STATUS_OK and STATUS_WARNING. `array` is where they will go. */
INTERNAL Status instance_prepare_get(Instance *self, const unsigned references[], size_t count, const void *array,
                                     VariableType type, const char *function);

/* STATUS_OK if some variables of a type can be set from `array`, each by instance_put. */
INTERNAL Status instance_prepare_set(Instance *self, const unsigned references[], size_t count, const void *array,
                                     VariableType type, const char *function);
INTERNAL void instance_put(Instance *self, unsigned reference, double value);

/* Get or set variables of a type that no model has. */
INTERNAL Status instance_without(Instance *self, size_t count, const char *type, const char *function);

/* Rates of inputs during the next step that is not refused, 1/s; then they are held again. */
INTERNAL Status instance_set_rates(Instance *self, const unsigned references[], size_t count, const int orders[],
                                   const double rates[], const char *function);

INTERNAL Status instance_step(Instance *self, double time, double duration, const char *function);

/* Count the values that cannot be used. */
INTERNAL void instance_count_faults(Instance *self);

/* ---------------------------------------------------------------------------------------- saved states, derivatives */

/* `state` points to NULL or to an earlier saved state, which is overwritten. */
INTERNAL Status instance_save(Instance *self, void **state, const char *function);
INTERNAL Status instance_restore(Instance *self, const void *state, const char *function);
INTERNAL Status instance_free_state(Instance *self, void **state, const char *function);
INTERNAL Status instance_serialized_size(Instance *self, const void *state, size_t *size, const char *function);
INTERNAL Status instance_serialize(Instance *self, const void *state, void *bytes, size_t size, const char *function);
INTERNAL Status instance_deserialize(Instance *self, const void *bytes, size_t size, void **state,
                                     const char *function);

/* Sums of the derivatives of the unknowns by the knowns, weighted with `seed`, at the present moment and state. */
INTERNAL Status instance_derivatives(Instance *self, const unsigned unknowns[], size_t n_unknowns,
                                     const unsigned knowns[], size_t n_knowns, const double seed[],
                                     double sensitivity[], const char *function);

#endif
