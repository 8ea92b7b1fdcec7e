
#define SWARMEVO_GROUND $ground
static WbDeviceTag ground[SWARMEVO_GROUND];

static void enable_ground(int step) {
    char name[16];
    int i;
    for (i = 0; i < SWARMEVO_GROUND; ++i) {
        sprintf(name, "gs%d", i);
        ground[i] = wb_robot_get_device(name);
        if (ground[i]) wb_distance_sensor_enable(ground[i], step);
    }
}

static double *sense_ground(double *next) {
    int i;
    for (i = 0; i < SWARMEVO_GROUND; ++i)
        *next++ = limited(ground[i] ? wb_distance_sensor_get_value(ground[i]) / $ground_full : 0.0, 0.0, 1.0);
    return next;
}
