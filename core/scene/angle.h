/* angle.h - sine and cosine of degrees in double, without libm, so that a scene
 * means the same numbers on every machine (HOUSE section 7).
 *
 * Exact at multiples of 90 degrees; elsewhere within 2 units in the last place.
 * |degrees| <= 1e9. Pure; any thread. */
#ifndef CORE_SCENE_ANGLE_H
#define CORE_SCENE_ANGLE_H

void
angle_sin_cos(double degrees, double *sine, double *cosine);

#endif
