/* material_blinn_phong.c - all fields; highlight k_s max(0, n.h)^p. */
#include "core/trace/materials.h"

void
material_blinn(const struct scene_material *material,
               struct material_record *record)
{
    record->paint[PAINT_DIFFUSE] = material->diffuse;
    record->paint[PAINT_AMBIENT] = material->ambient;
    record->paint[PAINT_SPECULAR] = material->specular;
    record->paint[PAINT_MIRROR] = material->mirror;
    record->paint[PAINT_EMISSION] = material->emission;
    record->shininess = material->shininess;
}
