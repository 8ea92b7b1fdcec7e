
/* For an E-puck's firmware. Call it once in each control period with what the sensors say, then set the motors:
 *
 *     swarmevo_step(proximity, touch, signal_strength, &left, &right);
 *     e_set_speed_left(left);
 *     e_set_speed_right(right);
 *
 *   proximity        ps0..ps7, calibrated, raw values: 0 is nothing in range
 *   touch            of the four box sensors, left to right: 1 at the box, else 0; an E-puck has none of its own
 *   signal_strength  of the emitter: 1/r^2 [1/m^2], 0 if nothing is heard
 *   left, right      [steps/s], 1000 steps a turn, at most 1000 either way
 */
void swarmevo_step(const int proximity[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH], double signal_strength,
                   int *left, int *right);

void swarmevo_step(const int proximity[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH], double signal_strength,
                   int *left, int *right) {
    double infrared[SWARMEVO_INFRARED], observation[SWARMEVO_OBSERVATIONS], command[SWARMEVO_COMMANDS];
    int i;
    for (i = 0; i < SWARMEVO_INFRARED; ++i) infrared[i] = proximity[i];
    swarmevo_observe(infrared, touch, signal_strength, observation);
    swarmevo_controller(observation, command);
    *left = steps_per_second(command[0]);
    *right = steps_per_second(command[1]);
}
