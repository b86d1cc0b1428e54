/* material_glazed.c - ambient and diffuse under a mirror. */
#include "core/trace/materials.h"

void
material_glazed(const struct scene_material *material,
                struct material_record *record)
{
    record->paint[PAINT_DIFFUSE] = material->diffuse;
    record->paint[PAINT_AMBIENT] = material->ambient;
    record->paint[PAINT_MIRROR] = material->mirror;
    record->paint[PAINT_EMISSION] = material->emission;
}
