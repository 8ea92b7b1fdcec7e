/* SPDX-License-Identifier: BSD-3-Clause
 *
 * $title
 *
 * $description C99, needs nothing but libm.
 *   observation  $names
 *   command      left and right wheel in [-1, 1] of the top speed$messages
 */
#include <math.h>

#define SWARMEVO_OBSERVATIONS $observations
#define SWARMEVO_COMMANDS $commands
#define SWARMEVO_CONTROL_PERIOD_MS $control_period_ms /* between two commands, as evolved */
#define SWARMEVO_TOP_SPEED $top_speed /* of a wheel [rad/s] */

void swarmevo_controller(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS]);

static double limited(double value, double least, double most) {
    return value < least ? least : value > most ? most : value;
}
