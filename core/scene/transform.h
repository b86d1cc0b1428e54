/* transform.h - affine maps in double: rows of 3 x 4, as in struct scene_object.
 *
 * p' = M p, the fourth column is the translation. Pure; any thread. */
#ifndef CORE_SCENE_TRANSFORM_H
#define CORE_SCENE_TRANSFORM_H

#include <stdbool.h>

void
transform_identity(double m[12]);

/* out = a after b (b acts first); out may be a or b. */
void
transform_multiply(const double a[12], const double b[12], double out[12]);

/* Right-hand rule around an axis of any length > 0 through the origin. */
void
transform_rotation(const double axis[3], double degrees, double m[12]);

/* Can it be inverted? The determinant of the linear part against the product
 * of its columns' lengths: below 1e-9 the image is a plane, for floats too. */
bool
transform_regular(const double m[12]);

/* Every entry within +-limit (and finite), every column of the linear part at
 * least 1 / limit long. */
bool
transform_within(const double m[12], double limit);

/* Length-preserving up to one factor (sdf nodes need that). */
bool
transform_uniform(const double m[12]);

double
vector_dot(const double a[3], const double b[3]);
void
vector_cross(const double a[3], const double b[3], double out[3]);

/* Unit vector of any vector but zero, however short or long; out may be a. */
void
vector_unit(const double a[3], double out[3]);
double
vector_length(const double a[3]);

#endif
