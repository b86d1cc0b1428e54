#include "core/scene/transform.h"

#include <math.h>
#include <string.h>

#include "core/scene/angle.h"

void
transform_identity(double m[12])
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    memcpy(m, identity, sizeof identity);
}

void
transform_multiply(const double a[12], const double b[12], double out[12])
{
    double m[12];
    for (int row = 0; row < 3; row++) {
        const double *r = a + 4 * row;
        for (int column = 0; column < 4; column++)
            m[4 * row + column] =
                r[0] * b[column] + r[1] * b[4 + column] + r[2] * b[8 + column];
        m[4 * row + 3] += r[3];
    }
    memcpy(out, m, sizeof m);
}

void
transform_rotation(const double axis[3], double degrees, double m[12])
{
    double n[3], s, c;
    vector_unit(axis, n);
    angle_sin_cos(degrees, &s, &c);
    double k = 1 - c; /* Rodrigues: cI + s[n]x + (1 - c)nn' */
    const double r[12] = {
        c + k * n[0] * n[0],        k * n[0] * n[1] - s * n[2],
        k * n[0] * n[2] + s * n[1], 0,
        k * n[1] * n[0] + s * n[2], c + k * n[1] * n[1],
        k * n[1] * n[2] - s * n[0], 0,
        k * n[2] * n[0] - s * n[1], k * n[2] * n[1] + s * n[0],
        c + k * n[2] * n[2],        0,
    };
    memcpy(m, r, sizeof r);
}

static void
columns(const double m[12], double x[3], double y[3], double z[3])
{
    for (int row = 0; row < 3; row++) {
        x[row] = m[4 * row];
        y[row] = m[4 * row + 1];
        z[row] = m[4 * row + 2];
    }
}

bool
transform_regular(const double m[12])
{
    double x[3], y[3], z[3], normal[3];
    columns(m, x, y, z);
    if (vector_length(x) == 0 || vector_length(y) == 0 || vector_length(z) == 0)
        return false;
    vector_unit(x, x);
    vector_unit(y, y);
    vector_unit(z, z);
    vector_cross(x, y, normal);
    return fabs(vector_dot(normal, z)) >= 1e-9;
}

bool
transform_within(const double m[12], double limit)
{
    double x[3], y[3], z[3];
    for (int i = 0; i < 12; i++) {
        if (!(fabs(m[i]) <= limit))
            return false;
    }
    columns(m, x, y, z);
    return vector_length(x) >= 1 / limit && vector_length(y) >= 1 / limit &&
           vector_length(z) >= 1 / limit;
}

bool
transform_uniform(const double m[12])
{
    double x[3], y[3], z[3];
    columns(m, x, y, z);
    double scale = vector_length(x), most = 1e-6 * scale;
    if (fabs(vector_length(y) - scale) > most ||
        fabs(vector_length(z) - scale) > most)
        return false;
    most *= scale;
    return fabs(vector_dot(x, y)) <= most && fabs(vector_dot(y, z)) <= most &&
           fabs(vector_dot(z, x)) <= most;
}

double
vector_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void
vector_cross(const double a[3], const double b[3], double out[3])
{
    const double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]};
    memcpy(out, c, sizeof c);
}

static double
largest(const double a[3])
{
    double most = fabs(a[0]);
    if (fabs(a[1]) > most)
        most = fabs(a[1]);
    if (fabs(a[2]) > most)
        most = fabs(a[2]);
    return most;
}

void
vector_unit(const double a[3], double out[3])
{
    /* Divided by the largest first: no square is lost or overflows. */
    double most = largest(a);
    double b[3] = {a[0] / most, a[1] / most, a[2] / most};
    double length = sqrt(vector_dot(b, b));
    for (int i = 0; i < 3; i++)
        out[i] = b[i] / length;
}

double
vector_length(const double a[3])
{
    double most = largest(a);
    if (most == 0)
        return 0;
    double b[3] = {a[0] / most, a[1] / most, a[2] / most};
    return most * sqrt(vector_dot(b, b));
}
