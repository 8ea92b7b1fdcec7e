/* SPDX-License-Identifier: BSD-3-Clause
 *
 * $title
 *
 * $description C99, needs nothing but libm.
 *   observation  $names
 *   command      left and right wheel in [-1, 1] of the top speed
 */
#include <math.h>

#define SWARMEVO_OBSERVATIONS $observations
#define SWARMEVO_INFRARED $infrared
#define SWARMEVO_TOUCH $touch
#define SWARMEVO_COMMANDS $commands
#define SWARMEVO_CONTROL_PERIOD_MS $control_period_ms /* between two commands, as evolved */
#define SWARMEVO_INFRARED_LARGEST $infrared_largest /* raw value at contact */
#define SWARMEVO_SIGNAL_LEAST $signal_least
#define SWARMEVO_SIGNAL_MOST $signal_most
#define SWARMEVO_TOP_SPEED $top_speed /* of a wheel [rad/s] */

void swarmevo_controller(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS]);
void swarmevo_observe(const double infrared[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH],
                      double signal_strength, double observation[SWARMEVO_OBSERVATIONS]);

