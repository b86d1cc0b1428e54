/* kernel_names.h - one name per ISA level for everything the stages share.
 *
 * Every file of the tracer that runs inside a tile is compiled once per level
 * (core/trace/CMakeLists.txt): portable, x86-64-v3, x86-64-v4. KERNEL_LEVEL
 * names the level; each symbol that crosses a file boundary gets it as a
 * suffix here, and the linker complains about one that was forgotten. Code
 * that is compiled once reaches a level through struct kernel (kernel.h).
 * Without KERNEL_LEVEL the names mean the portable level. */
#ifndef CORE_TRACE_KERNEL_NAMES_H
#define CORE_TRACE_KERNEL_NAMES_H

#ifndef KERNEL_LEVEL
#define KERNEL_LEVEL portable
#endif

#define KERNEL_JOIN_(name, level) name##_##level
#define KERNEL_JOIN(name, level)  KERNEL_JOIN_(name, level)
#define KERNEL(name)              KERNEL_JOIN(name, KERNEL_LEVEL)

#define accel_build         KERNEL(accel_build)
#define accel_free          KERNEL(accel_free)
#define accel_geometry      KERNEL(accel_geometry)
#define accel_intersect     KERNEL(accel_intersect)
#define accel_occluded      KERNEL(accel_occluded)
#define accel_small_nearest KERNEL(accel_small_nearest)
#define accel_small_any     KERNEL(accel_small_any)
#define camera_prepare      KERNEL(camera_prepare)
#define camera_rays         KERNEL(camera_rays)
#define geometry_build      KERNEL(geometry_build)
#define geometry_clear      KERNEL(geometry_clear)
#define kernel_table        KERNEL(kernel)
#define light_area_grid     KERNEL(light_area_grid)
#define light_directional   KERNEL(light_directional)
#define light_point         KERNEL(light_point)
#define light_table         KERNEL(light_table)
#define material_blinn      KERNEL(material_blinn)
#define material_glazed     KERNEL(material_glazed)
#define material_lambert    KERNEL(material_lambert)
#define material_mirror     KERNEL(material_mirror)
#define materials_build     KERNEL(materials_build)
#define materials_clear     KERNEL(materials_clear)
#define materials_fetch     KERNEL(materials_fetch)
#define mesh_surface        KERNEL(mesh_surface)
#define mesh_uv             KERNEL(mesh_uv)
#define plan_build          KERNEL(plan_build)
#define plan_free           KERNEL(plan_free)
#define sampler_fill        KERNEL(sampler_fill)
#define shape_box_ops       KERNEL(shape_box_ops)
#define shape_plane_ops     KERNEL(shape_plane_ops)
#define shape_quad_ops      KERNEL(shape_quad_ops)
#define shape_sphere_ops    KERNEL(shape_sphere_ops)
#define shape_table         KERNEL(shape_table)
#define shape_world_bounds  KERNEL(shape_world_bounds)
#define shape_triangle_ops  KERNEL(shape_triangle_ops)
#define surfaces_fill       KERNEL(surfaces_fill)
#define texture_checker     KERNEL(texture_checker)
#define texture_constant    KERNEL(texture_constant)
#define textures_apply      KERNEL(textures_apply)
#define tile_run            KERNEL(tile_run)
#define whitted_shade       KERNEL(whitted_shade)

#endif
