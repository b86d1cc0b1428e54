/* material_lambert.c - ambient, diffuse and emission. */
#include "core/trace/materials.h"

void
material_lambert(const struct scene_material *material,
                 struct material_record *record)
{
    record->paint[PAINT_DIFFUSE] = material->diffuse;
    record->paint[PAINT_AMBIENT] = material->ambient;
    record->paint[PAINT_EMISSION] = material->emission;
}
