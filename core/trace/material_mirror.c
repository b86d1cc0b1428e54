/* material_mirror.c - reflectance only. */
#include "core/trace/materials.h"

void
material_mirror(const struct scene_material *material,
                struct material_record *record)
{
    record->paint[PAINT_MIRROR] = material->mirror;
}
