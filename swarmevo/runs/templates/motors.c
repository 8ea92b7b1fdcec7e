
#define SWARMEVO_STEPS_PER_RADIAN 159.15494309189535
#define SWARMEVO_MOST_STEPS 1000.0

static int steps_per_second(double command) {
    const double steps = command * SWARMEVO_TOP_SPEED * SWARMEVO_STEPS_PER_RADIAN;
    return (int)floor(limited(steps, -SWARMEVO_MOST_STEPS, SWARMEVO_MOST_STEPS) + 0.5);
}
