/* What only the whole document can tell: names, budgets, and relations that
 * reach from one part into another. */
#include "core/scene/scene_reader.h"

#include <math.h>
#include <string.h>

#include "core/scene/scene_cost.h"

/* --- names ---------------------------------------------------------------------- */

static void
collect(struct reader *r, const struct json *array, struct names *names)
{
    uint32_t index = 0;
    if (array == NULL || array->type != JSON_ARRAY ||
        array->count > LIMIT_SURFACES)
        return;
    for (const struct json *n = array->child; n != NULL; n = n->next) {
        const struct json *name = json_member(n, "name");
        if (name != NULL && name->type == JSON_STRING)
            names_add(names, name, index, r->arena);
        index++;
    }
    names_sort(names);
}

/* Empty places for the entries of a named array, so that a reference is its
 * index whatever the document tells first. */
static void
reserve(struct reader *r, const struct json *array, struct vector *vector,
        size_t size)
{
    static const char zeros[sizeof(struct scene_material)];
    if (array == NULL || array->type != JSON_ARRAY ||
        array->count > LIMIT_SURFACES)
        return;
    for (uint32_t i = 0; i < array->count; i++)
        reader_push(r, vector, zeros, size);
}

_Static_assert(sizeof(struct scene_texture) <= sizeof(struct scene_material),
               "`zeros` is as large as either");

void
collect_names(struct reader *r)
{
    const struct json *textures = json_member(r->root, "textures");
    const struct json *materials = json_member(r->root, "materials");
    const struct json *assets = json_member(r->root, "assets");

    collect(r, textures, &r->textures);
    collect(r, materials, &r->materials);
    collect(r, json_member(r->root, "definitions"), &r->definitions);
    reserve(r, textures, &r->texture_items, sizeof(struct scene_texture));
    reserve(r, materials, &r->material_items, sizeof(struct scene_material));
    if (textures != NULL)
        r->texture_reflects = arena_array(r->arena, textures->count, 1);
    if (assets == NULL || assets->type != JSON_OBJECT ||
        assets->count > LIMIT_ASSETS)
        return;
    for (const struct json *m = assets->child; m != NULL; m = m->next) {
        struct json *key = arena_alloc(r->arena, sizeof *key);
        if (key == NULL)
            return;
        *key = *m;
        key->type = JSON_STRING;
        key->string = m->key;
        names_add(&r->assets, key, 0, r->arena);
    }
    names_sort(&r->assets);
}

/* Sorted by name, then by place: of equal neighbours the later is at fault. */
static void
check_unique(struct reader *r, const struct names *names)
{
    for (uint32_t i = 1, first = 0; i < names->count; i++) {
        const struct name_entry *a = &names->items[first];
        const struct name_entry *b = &names->items[i];
        if (a->name[0] == '\0' || !is_text(b->node, a->name)) {
            first = i;
            continue;
        }
        fault(r, ERROR_NAME_DUPLICATE, b->node,
              "names are unique in their list", NULL,
              "`%.64s` is already the name of %s", b->name,
              can_tell(r) ? json_pointer(a->node->parent, r->arena) : "");
    }
}

static void
check_light_names(struct reader *r)
{
    struct names names = {0};
    collect(r, json_member(r->root, "lights"), &names);
    check_unique(r, &names);
}

/* --- textures that reflect -------------------------------------------------------------- */

void
check_reflectance(struct reader *r, const struct json *texture)
{
    static const char *const names[] = {"color", "color0", "color1"};
    for (size_t i = 0; i < COUNT_OF(names); i++) {
        const struct json *color = json_member(texture, names[i]);
        if (color == NULL || color->type != JSON_ARRAY)
            continue;
        for (const struct json *n = color->child; n != NULL; n = n->next) {
            if (n->type == JSON_NUMBER && n->number > 1 && n->number <= 1e6)
                fault(r, ERROR_NUMBER_TOO_LARGE, n,
                      "nothing reflects more light than it gets", NULL,
                      "a texture that a reflectance uses is at most 1, got %s",
                      number_said(r, n->number));
        }
    }
}

static void
check_named_reflectances(struct reader *r)
{
    const struct json *textures = json_member(r->root, "textures");
    if (textures == NULL || textures->type != JSON_ARRAY ||
        r->texture_reflects == NULL)
        return;
    uint32_t i = 0;
    for (const struct json *n = textures->child; n != NULL; n = n->next) {
        if (r->texture_reflects[i++])
            check_reflectance(r, n);
    }
}

/* --- materials and the integrator ---------------------------------------------------------- */

/* `mean` and `fresnel_weighted` know two kinds of material. Every material of
 * the document counts, used or not. The relation is told at the first of its
 * two values in the document (SCENE section 8), and at `accumulation` once. */
static void
check_accumulation(struct reader *r)
{
    const struct json *integrator = json_member(r->root, "integrator");
    const struct json *accumulation = json_member(integrator, "accumulation");
    bool told = false;
    if (!is_text(accumulation, "mean") &&
        !is_text(accumulation, "fresnel_weighted"))
        return;
    const struct json *const *nodes = r->material_nodes.items;
    for (uint32_t i = 0; i < r->material_nodes.count; i++) {
        const struct json *type = json_member(nodes[i], "type");
        const struct json *place = first_of(accumulation, type);
        if (is_text(type, "lambert") || is_text(type, "blinn_phong") ||
            (place == accumulation && told))
            continue;
        told = told || place == accumulation;
        const char *where = can_tell(r) ? json_pointer(nodes[i], r->arena) : "";
        fault(r, ERROR_INTEGRATOR_MATERIAL, place,
              arena_printf(r->arena,
                           "change the material %s, or take `accumulation` "
                           "`recursive`",
                           where),
              NULL, "`%s` knows `lambert` and `blinn_phong`, not `%s`",
              accumulation->string, type->string);
    }
}

/* Glass doubles the rays at every hit. */
static void
check_glass(struct reader *r)
{
    const struct json *integrator = json_member(r->root, "integrator");
    const struct json *bounces = json_member(integrator, "max_bounces");
    if (bounces == NULL || bounces->type != JSON_NUMBER ||
        bounces->number <= 12 || bounces->number > 64 ||
        family_kind_of(&family_integrator, integrator) !=
            family_integrator.fallback)
        return;
    const struct json *const *nodes = r->material_nodes.items;
    for (uint32_t i = 0; i < r->material_nodes.count; i++) {
        if (!is_text(json_member(nodes[i], "type"), "dielectric"))
            continue;
        fault(r, ERROR_NUMBER_TOO_LARGE, bounces,
              "`whitted` follows two rays from every hit on glass",
              fix_number(r, bounces, 12),
              "must be at most 12 with a `dielectric`, got %s",
              number_said(r, bounces->number));
        return;
    }
}

/* --- cycles ------------------------------------------------------------------------------ */

enum mark { UNSEEN, OPEN, DONE };

struct cycle {
    struct reader *r;
    const struct json *array;  /* /materials or /definitions */
    const struct names *names; /* of that array */
    const char *const *keys;   /* members that refer to it */
    size_t key_count;
    const char *noun;
    unsigned char *marks; /* [array->count], enum mark */
};

static void
follow_entry(const struct cycle *c, uint32_t index);

/* References below `node`; the document's depth limits the recursion within
 * one entry, the number of entries (1024) the one between them. */
static void
follow(const struct cycle *c, const struct json *node)
{
    for (const struct json *m = node->child; m != NULL; m = m->next) {
        if (m->type == JSON_OBJECT || m->type == JSON_ARRAY) {
            follow(c, m);
            continue;
        }
        if (m->type != JSON_STRING || m->key == NULL)
            continue;
        for (size_t i = 0; i < c->key_count; i++) {
            const struct name_entry *entry =
                strcmp(m->key, c->keys[i]) == 0
                    ? names_find(c->names, m->string)
                    : NULL;
            if (entry == NULL)
                continue;
            if (c->marks[entry->index] == OPEN)
                fault(c->r, ERROR_REFERENCE_CYCLE, m, NULL, NULL,
                      "the %s `%s` contains itself", c->noun, m->string);
            else
                follow_entry(c, entry->index);
        }
    }
}

static void
follow_entry(const struct cycle *c, uint32_t index)
{
    if (c->marks[index] != UNSEEN)
        return;
    const struct json *entry = c->array->child;
    for (uint32_t i = 0; i < index; i++)
        entry = entry->next;
    c->marks[index] = OPEN;
    follow(c, entry);
    c->marks[index] = DONE;
}

static void
check_cycles(struct reader *r, const char *array, const struct names *names,
             const char *const *keys, size_t key_count, const char *noun)
{
    struct cycle c = {.r = r,
                      .array = json_member(r->root, array),
                      .names = names,
                      .keys = keys,
                      .key_count = key_count,
                      .noun = noun};
    if (names->count == 0)
        return;
    c.marks = arena_array(r->arena, c.array->count, 1);
    for (uint32_t i = 0; c.marks != NULL && i < c.array->count; i++)
        follow_entry(&c, i);
}

/* --- budgets ------------------------------------------------------------------------------- */

/* The first of the numbers that make rays, or the document. */
static const struct json *
ray_place(const struct reader *r)
{
    static const char *const parts[][2] = {{"film", "width"},
                                           {"film", "height"},
                                           {"sampler", "spp"},
                                           {"integrator", "max_bounces"}};
    const struct json *place = NULL;
    for (size_t i = 0; i < COUNT_OF(parts); i++)
        place = first_of(
            place, json_member(json_member(r->root, parts[i][0]), parts[i][1]));
    place = first_of(place, json_member(r->root, "lights"));
    return place != NULL ? place : r->root;
}

static void
check_rays(struct reader *r)
{
    struct output output;
    output_default(&output);
    double rays = scene_cost(r->scene, &output, 0).rays;
    double most = (double)r->limits.max_rays;
    if (rays <= most)
        return;
    double spp = (double)(uint32_t)(r->scene->sampler.spp * (most / rays));
    fault(r, ERROR_BUDGET_RAYS, ray_place(r),
          spp >= 1 ? arena_printf(r->arena, "`spp` %.0f would fit", spp)
                   : "a smaller film or fewer light samples would fit",
          NULL, "about %.3g rays, at most %.3g", rays, most);
}

void
read_extras(struct reader *r, const struct json *value,
            const struct field *field, void *to)
{
    (void)field, (void)to;
    if (value == NULL)
        return;
    if (value->type != JSON_OBJECT)
        fault_type(r, value, "an object");
    else if (value->end - value->begin > LIMIT_EXTRAS)
        fault(r, ERROR_BUDGET_BYTES, value, NULL, NULL,
              "%zu bytes of `extras`, at most %d", value->end - value->begin,
              LIMIT_EXTRAS);
}

void
check_document(struct reader *r)
{
    static const char *const mixed[] = {"a", "b"};
    static const char *const of[] = {"of"};
    check_unique(r, &r->textures);
    check_unique(r, &r->materials);
    check_unique(r, &r->definitions);
    names_sort(&r->objects);
    check_unique(r, &r->objects);
    check_light_names(r);
    check_named_reflectances(r);
    check_accumulation(r);
    check_glass(r);
    check_cycles(r, "materials", &r->materials, mixed, COUNT_OF(mixed),
                 "material");
    check_cycles(r, "definitions", &r->definitions, of, COUNT_OF(of),
                 "definition");
    if (r->faults == 0 && r->items.count == 0 && !r->arena->failed)
        check_rays(r);
}
