
static WbDeviceTag signal_receiver;
static struct heard signals[SWARMEVO_SOURCES + 1];

static void enable_signals(int step) {
    signal_receiver = receiver_named("receiver", step);
    forget(signals, SWARMEVO_SOURCES);
}

static void hear_signals(void) {
    hear(signal_receiver, signals, SWARMEVO_SOURCES);
}
