/* SPDX-License-Identifier: BSD-3-Clause
 * Compiled as C11: the header is what it says. */
#include "swarmevo.h"

_Static_assert(sizeof(swe_status) == 4, "a status is an int32_t");
