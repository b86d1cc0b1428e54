/* A scene's effective values, for people and programs to read. */
#include "core/scene/scene_json.h"

#include "core/scene/kinds.h"

static void
put_color(struct json_writer *w, const char *key, const double color[3])
{
    json_begin_array(w, key);
    for (int i = 0; i < 3; i++)
        json_put_number(w, NULL, color[i]);
    json_end_array(w);
}

static void
put_integrator(struct json_writer *w, const struct scene_integrator *i)
{
    static const char *const accumulations[] = {"recursive", "mean",
                                                "fresnel_weighted"};
    static const char *const shadows[] = {"none", "hard", "soft"};
    json_begin_object(w, "integrator");
    json_put_string(w, "accumulation", accumulations[i->accumulation]);
    put_color(w, "ambient", i->ambient);
    if (i->clamp_local > 0)
        json_put_number(w, "clamp_local", i->clamp_local);
    else
        json_put_null(w, "clamp_local");
    if (i->accumulation == ACCUMULATION_FRESNEL_WEIGHTED) {
        json_begin_object(w, "fresnel");
        json_put_number(w, "bias", i->fresnel_bias);
        json_put_number(w, "exponent", i->fresnel_exponent);
        json_end_object(w);
    }
    json_put_bool(w, "inside_hits", i->inside_hits);
    json_put_integer(w, "max_bounces", i->max_bounces);
    json_put_number(w, "ray_offset", i->ray_offset);
    json_put_string(w, "shadows", shadows[i->shadows]);
    json_put_string(w, "type", "whitted");
    json_end_object(w);
}

void
scene_write_settings(const struct scene *scene, struct bytes *out)
{
    static const char *const samplers[] = {"center", "independent",
                                           "stratified", "sobol"};
    struct json_writer w = {.out = out};
    json_begin_object(&w, NULL);
    json_begin_object(&w, "film");
    json_begin_object(&w, "filter");
    json_put_number(&w, "radius", 0.5);
    json_put_string(&w, "type", "box");
    json_end_object(&w);
    json_put_integer(&w, "height", scene->height);
    json_put_integer(&w, "width", scene->width);
    json_end_object(&w);
    put_integrator(&w, &scene->integrator);
    json_begin_object(&w, "sampler");
    json_put_integer(&w, "seed", scene->sampler.seed);
    json_put_integer(&w, "spp", scene->sampler.spp);
    json_put_string(&w, "type", samplers[scene->sampler.kind]);
    json_end_object(&w);
    json_end_object(&w);
}

void
scene_write_object_counts(const struct scene *scene, struct bytes *out)
{
    uint32_t counts[SHAPE_KIND_COUNT] = {0};
    struct json_writer w = {.out = out};
    for (uint32_t i = 0; i < scene->object_count; i++)
        counts[scene->objects[i].kind]++;
    json_begin_object(&w, NULL);
    for (size_t i = 0; i < family_shape.kind_count; i++) {
        const struct kind *kind = &family_shape.kinds[i];
        if (kind->value >= 0 && kind->value < SHAPE_KIND_COUNT &&
            counts[kind->value] > 0)
            json_put_integer(&w, kind->name, counts[kind->value]);
    }
    json_end_object(&w);
}
