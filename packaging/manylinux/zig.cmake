# SPDX-License-Identifier: BSD-3-Clause
# Compile with zig, for glibc 2.17 and any x86-64; $ENV{ZIG} is its program.
set(CMAKE_C_COMPILER $ENV{ZIG} cc)
set(CMAKE_CXX_COMPILER $ENV{ZIG} c++)
# Optimised in every build type: else zig builds its C++ library twice.
set(CMAKE_C_FLAGS_INIT "-target x86_64-linux-gnu.2.17 -O2")
set(CMAKE_CXX_FLAGS_INIT "-target x86_64-linux-gnu.2.17 -O2")
