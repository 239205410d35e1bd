/* SPDX-License-Identifier: MIT */
/* Declarations of what examples/embedded/zephyr uses, after Zephyr's documentation: enough for a
 * compiler, no more. */
#pragma once
struct device;
