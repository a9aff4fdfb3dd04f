/* One instance of the FMU, and what the files of the FMI layer share. */
#ifndef FMI2_INSTANCE_H
#define FMI2_INSTANCE_H

#include "fmi2Functions.h"
#include "model.h"

typedef enum {
    INSTANTIATED = 1,
    INITIALIZATION = 2,
    STEP_COMPLETE = 4,
    STEP_FAILED = 8, /* the last step was refused; everything is as before it */
    TERMINATED = 16,
    BROKEN = 32,
    STEPPING = STEP_COMPLETE | STEP_FAILED,
    ANY = 63
} Mode;

typedef struct {
    Model model;
    Mode mode;
    fmi2CallbackFunctions callbacks;
    fmi2CallbackFreeMemory release; /* frees this instance and its saved states: the host's function, or free */
    const char *name;
    unsigned logged; /* bit 1 << status: messages of that status are passed on */
    int experiment;  /* fmi2SetupExperiment was called */
    unsigned faults; /* how many settable values cannot be used */
    int fresh, blank; /* calculated values belong to the present moment; there are none, so they are NaN */
    int ramping;      /* there may be slopes that are not 0 */
    fmi2Status last_step;
    double *values, *slopes;
    char complained[MESSAGE_SIZE]; /* the last complaint about values, told once */
} Instance;

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility push(hidden)
#endif

/* Log a message and give its status back. */
fmi2Status report(Instance *self, fmi2Status status, const char *format, ...);

/* Whether a call is allowed in the present mode; false, with a message, if not or if there is no instance. */
int allowed(Instance *self, unsigned modes, const char *function);

/* Count the values that cannot be used. */
void count_faults(Instance *self);

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility pop
#endif
#endif
