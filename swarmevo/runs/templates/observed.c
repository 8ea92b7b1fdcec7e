
/* For an E-puck's firmware. Call it once in each control period with an observation, then set the motors:
 *
 *     observation[SWARMEVO_${first}] = ...;
 *     swarmevo_step(observation, command, &left, &right);
 *     e_set_speed_left(left);
 *     e_set_speed_right(right);
 *
 *   observation      what the sensors read, each as swarmevo's page on robots and their sensors says
 *   command          as the network gives it; a bit of the message is set where its command is above 0
 *   left, right      [steps/s], 1000 steps a turn, at most 1000 either way
 */
enum { /* places in an observation */
$observation_places};
enum { /* places in a command */
$command_places};

void swarmevo_step(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS], int *left,
                   int *right);

void swarmevo_step(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS], int *left,
                   int *right) {
    swarmevo_controller(observation, command);
    *left = steps_per_second(command[SWARMEVO_LEFT]);
    *right = steps_per_second(command[SWARMEVO_RIGHT]);
}
