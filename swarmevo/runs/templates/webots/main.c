
/* A Webots controller for a robot with the devices of the world that swarmevo writes; a device that a robot has not reads as
 * nothing. Its first argument is the robot's number. */
#include <stdio.h>
#include <stdlib.h>
#include <webots/distance_sensor.h>
#include <webots/emitter.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/receiver.h>
#include <webots/robot.h>
#include <webots/touch_sensor.h>
$devices
static WbDeviceTag motor(const char *name) {
    const WbDeviceTag tag = wb_robot_get_device(name);
    wb_motor_set_position(tag, INFINITY); /* turn at a speed */
    wb_motor_set_velocity(tag, 0.0);
    return tag;
}

/* Simulate some steps of the world; 0: it ends. */
static int passed(int steps, int step, const double command[SWARMEVO_COMMANDS]) {
    int i;
    (void)command; /* robots without range and bearing send nothing */
    for (i = 0; i < steps; ++i) {
$send        if (wb_robot_step(step) == -1) return 0;
$hear    }
    return 1;
}

int main(int argc, char **argv) {
    double observation[SWARMEVO_OBSERVATIONS], command[SWARMEVO_COMMANDS] = {0.0};
    WbDeviceTag left, right;
    int step, steps, wait = 1; /* sensors have their first values a step after they were enabled */
    wb_robot_init();
    step = (int)floor(wb_robot_get_basic_time_step() + 0.5);
    steps = (SWARMEVO_CONTROL_PERIOD_MS + step / 2) / step;
    if (steps < 1) steps = 1;
    if (steps * step != SWARMEVO_CONTROL_PERIOD_MS)
        fprintf(stderr, "swarmevo: the control period of %d ms is no multiple of the world's step of %d ms: it is %d ms here\n",
                SWARMEVO_CONTROL_PERIOD_MS, step, steps * step);
    (void)argc, (void)argv, (void)limited; /* not every robot needs them */
$enable    left = motor("left wheel motor");
    right = motor("right wheel motor");
    while (passed(wait, step, command)) {
        double *next = observation;
$sense        (void)next;
        swarmevo_controller(observation, command);
        wb_motor_set_velocity(left, command[0] * SWARMEVO_TOP_SPEED);
        wb_motor_set_velocity(right, command[1] * SWARMEVO_TOP_SPEED);
        wait = steps;
    }
    wb_robot_cleanup();
    return 0;
}
