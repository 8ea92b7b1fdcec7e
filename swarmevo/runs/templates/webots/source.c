/* SPDX-License-Identifier: BSD-3-Clause
 *
 * Sends the number of each emitter of its robot, which is in the emitter's name, in every step of the world. */
#include <stdio.h>
#include <webots/device.h>
#include <webots/emitter.h>
#include <webots/nodes.h>
#include <webots/robot.h>

int main(void) {
    int devices, step, i;
    wb_robot_init();
    devices = wb_robot_get_number_of_devices();
    step = (int)(wb_robot_get_basic_time_step() + 0.5);
    do {
        for (i = 0; i < devices; ++i) {
            const WbDeviceTag tag = wb_robot_get_device_by_index(i);
            unsigned number = 0;
            unsigned char packet;
            if (wb_device_get_node_type(tag) != WB_NODE_EMITTER) continue;
            if (sscanf(wb_device_get_name(tag), "emitter %u", &number) != 1) continue;
            packet = (unsigned char)number;
            wb_emitter_send(tag, &packet, 1);
        }
    } while (wb_robot_step(step) != -1);
    wb_robot_cleanup();
    return 0;
}
