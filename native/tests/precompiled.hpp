// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What most tests include, compiled once: a quarter less time to build them.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>
