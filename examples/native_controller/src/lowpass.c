/* SPDX-License-Identifier: BSD-3-Clause
 *
 * swe_policy_function of swarmevo.h: the library calls it for each robot in each control step, from several threads at
 * once. It keeps nothing but what it writes to memory, which is the robot's own and zero when an episode starts.
 */
#include <math.h>
#include <stddef.h>

/* A wheel's speed is a weighted sum of smoothed readings and a constant.
 *   parameters   how many observations and commands there are, then the genes: of each reading how fast its smoothed
 *                value follows it, of each command the weights and the constant
 */
void lowpass_act(const void *parameters, const double *observation, double *memory, double *command) {
    const double *sizes = parameters, *speeds = sizes + 2;
    const size_t observations = (size_t)sizes[0], commands = (size_t)sizes[1];
    const double *weights = speeds + observations;
    for (size_t i = 0; i < observations; ++i) {
        const double share = 1 / (1 + exp(-speeds[i])); /* of the way, in a control step */
        memory[i] += share * (observation[i] - memory[i]);
    }
    for (size_t o = 0; o < commands; ++o, weights += observations + 1) {
        double sum = weights[observations];
        for (size_t i = 0; i < observations; ++i) sum += weights[i] * memory[i];
        command[o] = tanh(sum);
    }
}
