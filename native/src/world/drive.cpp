// SPDX-License-Identifier: BSD-3-Clause
#include "world/drive.hpp"

namespace swarmevo {

std::unique_ptr<Drive> create_drive(const Scene& scene, dWorldID world, const Pose& start) {
    return scene.physics.drive == SWE_DRIVE_ARTICULATED ? create_articulated(scene, world, start)
                                                        : create_driven_contacts(scene, world, start);
}

}  // namespace swarmevo
