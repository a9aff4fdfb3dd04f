/* A table of speed over time, straight between its rows and held at its ends. Implements model.h. */
#include "cycle_table.h"
#include "model.h"

const size_t model_state_size = sizeof(double), model_scratch_size = sizeof(double); /* there is neither */

ModelStatus model_start(Model *model) { return (void)model, MODEL_OK; }

ModelStatus model_step(Model *model, double duration) { return (void)model, (void)duration, MODEL_OK; }

ModelStatus model_outputs(Model *model) {
    const double time = model->time;
    int row = 0, end = CYCLE_ROWS - 1;
    while (end - row > 1) { /* the row before this moment */
        const int middle = (row + end) / 2;
        if (CYCLE_TIME[middle] <= time) row = middle;
        else end = middle;
    }
    if (time <= CYCLE_TIME[row]) model->values[0] = CYCLE_SPEED[row];
    else if (time >= CYCLE_TIME[end]) model->values[0] = CYCLE_SPEED[end];
    else
        model->values[0] = CYCLE_SPEED[row] + (CYCLE_SPEED[end] - CYCLE_SPEED[row]) * (time - CYCLE_TIME[row])
                                                  / (CYCLE_TIME[end] - CYCLE_TIME[row]);
    return MODEL_OK;
}
