
/* A Webots controller. Devices of the E-puck: distance sensors ps0..ps7, motors "left wheel motor" and "right wheel
 * motor". To be added to its turret: touch sensors ts0..ts3 of type "bumper", from left to right, and a receiver
 * "receiver" that hears the source's emitter, whose signal strength Webots reports as 1/r^2. What is missing reads 0. */
#include <stdio.h>
#include <webots/distance_sensor.h>
#include <webots/motor.h>
#include <webots/receiver.h>
#include <webots/robot.h>
#include <webots/touch_sensor.h>

static double heard(WbDeviceTag receiver) {
    double strength = 0.0;
    while (receiver && wb_receiver_get_queue_length(receiver) > 0) {
        strength = wb_receiver_get_signal_strength(receiver);
        wb_receiver_next_packet(receiver);
    }
    return strength;
}

static WbDeviceTag motor(const char *name) {
    const WbDeviceTag tag = wb_robot_get_device(name);
    wb_motor_set_position(tag, INFINITY); /* turn at a speed */
    wb_motor_set_velocity(tag, 0.0);
    return tag;
}

int main(void) {
    WbDeviceTag proximity[SWARMEVO_INFRARED], bumpers[SWARMEVO_TOUCH], receiver, left, right;
    char name[8];
    int i;
    wb_robot_init();
    for (i = 0; i < SWARMEVO_INFRARED; ++i) {
        sprintf(name, "ps%d", i);
        proximity[i] = wb_robot_get_device(name);
        if (proximity[i]) wb_distance_sensor_enable(proximity[i], SWARMEVO_CONTROL_PERIOD_MS);
    }
    for (i = 0; i < SWARMEVO_TOUCH; ++i) {
        sprintf(name, "ts%d", i);
        bumpers[i] = wb_robot_get_device(name);
        if (bumpers[i]) wb_touch_sensor_enable(bumpers[i], SWARMEVO_CONTROL_PERIOD_MS);
    }
    receiver = wb_robot_get_device("receiver");
    if (receiver) wb_receiver_enable(receiver, SWARMEVO_CONTROL_PERIOD_MS);
    left = motor("left wheel motor");
    right = motor("right wheel motor");

    while (wb_robot_step(SWARMEVO_CONTROL_PERIOD_MS) != -1) {
        double infrared[SWARMEVO_INFRARED], touch[SWARMEVO_TOUCH];
        double observation[SWARMEVO_OBSERVATIONS], command[SWARMEVO_COMMANDS];
        for (i = 0; i < SWARMEVO_INFRARED; ++i)
            infrared[i] = proximity[i] ? wb_distance_sensor_get_value(proximity[i]) : 0.0;
        for (i = 0; i < SWARMEVO_TOUCH; ++i) touch[i] = bumpers[i] ? wb_touch_sensor_get_value(bumpers[i]) : 0.0;
        swarmevo_observe(infrared, touch, heard(receiver), observation);
        swarmevo_controller(observation, command);
        wb_motor_set_velocity(left, command[0] * SWARMEVO_TOP_SPEED);
        wb_motor_set_velocity(right, command[1] * SWARMEVO_TOP_SPEED);
    }
    wb_robot_cleanup();
    return 0;
}
