
#define SWARMEVO_TOUCH $touch
static WbDeviceTag bumpers[SWARMEVO_TOUCH];

static void enable_touch(int step) {
    char name[16];
    int i;
    for (i = 0; i < SWARMEVO_TOUCH; ++i) {
        sprintf(name, "ts%d", i);
        bumpers[i] = wb_robot_get_device(name);
        if (bumpers[i]) wb_touch_sensor_enable(bumpers[i], step);
    }
}

static double *sense_touch(double *next) {
    int i;
    for (i = 0; i < SWARMEVO_TOUCH; ++i)
        *next++ = limited(bumpers[i] ? wb_touch_sensor_get_value(bumpers[i]) : 0.0, 0.0, 1.0);
    return next;
}
