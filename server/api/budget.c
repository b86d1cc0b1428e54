#include "server/api/budget.h"

enum { FILM_SIDE_MAX = 8192 };
static const double max_pixels_default = 16777216;
static const double max_rays_default = 2e10;

struct budget {
    const struct api_options *options;
    const struct order *order;
    double rays, seconds, memory_bytes; /* allowed; 0: no limit */
};

static double
or_default(double value, double otherwise)
{
    return value > 0 ? value : otherwise;
}

static struct budget
budget_of(const struct api_options *options, const struct order *order)
{
    return (struct budget){
        .options = options,
        .order = order,
        .rays = or_default((double)options->scene_limits.max_rays,
                           max_rays_default),
        .seconds = options->max_render_seconds,
        .memory_bytes = (double)options->max_render_bytes,
    };
}

static bool
within(double value, double limit)
{
    return limit <= 0 || value <= limit;
}

/* Would the scene fit with these settings? Speed stays what it was. */
static bool
fits(const struct budget *budget, uint32_t width, uint32_t height, uint32_t spp,
     uint32_t max_bounces)
{
    const struct order *order = budget->order;
    struct scene scene = order->scene;
    double speed =
        order->cost.seconds > 0 ? order->cost.rays / order->cost.seconds : 0;
    struct scene_cost cost;

    scene.width = width;
    scene.height = height;
    scene.sampler.spp = spp;
    scene.integrator.max_bounces = max_bounces;
    cost = scene_cost(&scene, &order->document.output, speed);
    return within(cost.rays, budget->rays) &&
           within(cost.seconds, budget->seconds) &&
           within(cost.memory_bytes, budget->memory_bytes);
}

static uint32_t
side_for(double width, double height, uint32_t fit_width)
{
    double side = height * fit_width / width;

    return side < 1 ? 1 : (uint32_t)side;
}

void
budget_fit_film(double width, double height, double max_pixels,
                uint32_t *fit_width, uint32_t *fit_height)
{
    uint32_t low = 1, high = FILM_SIDE_MAX;

    while (low < high) {
        uint32_t middle = low + (high - low + 1) / 2;
        uint32_t side = side_for(width, height, middle);

        if (side <= FILM_SIDE_MAX && middle <= width &&
            (double)middle * side <= max_pixels)
            low = middle;
        else
            high = middle - 1;
    }
    *fit_width = low;
    *fit_height = side_for(width, height, low);
}

/* Each looks for the largest smaller value of one setting; 0 if none fits. */
static uint32_t
fit_spp(const struct budget *budget)
{
    const struct scene *scene = &budget->order->scene;
    uint32_t low = 0, high = scene->sampler.spp - 1, root;

    while (low < high) {
        uint32_t middle = low + (high - low + 1) / 2;

        if (fits(budget, scene->width, scene->height, middle,
                 scene->integrator.max_bounces))
            low = middle;
        else
            high = middle - 1;
    }
    if (scene->sampler.kind != SAMPLER_STRATIFIED)
        return low;
    for (root = 0; (root + 1) * (root + 1) <= low; root++)
        ;
    return root * root; /* a stratified pixel is a square of cells */
}

static uint32_t
fit_width(const struct budget *budget, uint32_t *height)
{
    const struct scene *scene = &budget->order->scene;
    uint32_t low = 0, high = scene->width - 1;

    while (low < high) {
        uint32_t middle = low + (high - low + 1) / 2;

        if (fits(budget, middle, side_for(scene->width, scene->height, middle),
                 scene->sampler.spp, scene->integrator.max_bounces))
            low = middle;
        else
            high = middle - 1;
    }
    *height = low ? side_for(scene->width, scene->height, low) : 0;
    return low;
}

/* -1 if none fits */
static int64_t
fit_bounces(const struct budget *budget)
{
    const struct scene *scene = &budget->order->scene;
    int64_t bounces = (int64_t)scene->integrator.max_bounces - 1;

    while (bounces >= 0 && !fits(budget, scene->width, scene->height,
                                 scene->sampler.spp, (uint32_t)bounces))
        bounces--;
    return bounces;
}

static void
write_fit(struct json_writer *w, const struct order *order, const char *pointer,
          double value)
{
    struct bytes path = {0};

    bytes_printf(&path, "%s%s", order->document.prefix, pointer);
    json_put_number(w, path.data ? path.data : pointer, value);
    bytes_clear(&path);
}

static void
write_film_fit(struct json_writer *w, const struct order *order, uint32_t width,
               uint32_t height)
{
    json_begin_object(w, NULL);
    write_fit(w, order, "/film/width", width);
    write_fit(w, order, "/film/height", height);
    json_end_object(w);
}

/* Each entry alone is enough. */
static void
write_fits(struct json_writer *w, const struct budget *budget)
{
    const struct order *order = budget->order;
    uint32_t height, width = fit_width(budget, &height);
    uint32_t spp = fit_spp(budget);
    int64_t bounces = fit_bounces(budget);

    json_begin_array(w, "fits");
    if (spp > 0) {
        json_begin_object(w, NULL);
        write_fit(w, order, "/sampler/spp", spp);
        json_end_object(w);
    }
    if (width > 0)
        write_film_fit(w, order, width, height);
    if (bounces >= 0) {
        json_begin_object(w, NULL);
        write_fit(w, order, "/integrator/max_bounces", (double)bounces);
        json_end_object(w);
    }
    json_end_array(w);
}

static void
put_limit(struct json_writer *w, const char *key, double value)
{
    if (value > 0)
        json_put_number(w, key, value);
    else
        json_put_null(w, key);
}

static void
write_budget(struct json_writer *w, const void *user)
{
    const struct budget *budget = user;
    const struct scene_cost *cost = &budget->order->cost;

    json_begin_object(w, "requested");
    json_put_number(w, "rays", cost->rays);
    json_put_number(w, "seconds", cost->seconds);
    json_put_number(w, "memory_bytes", cost->memory_bytes);
    json_end_object(w);
    json_begin_object(w, "allowed");
    put_limit(w, "rays", budget->rays);
    put_limit(w, "seconds", budget->seconds);
    put_limit(w, "memory_bytes", budget->memory_bytes);
    json_end_object(w);
    write_fits(w, budget);
}

/* Which limit it is over, NULL if none. */
static const char *
sentence(const struct budget *budget, struct arena *arena)
{
    const struct scene_cost *cost = &budget->order->cost;

    if (!within(cost->rays, budget->rays))
        return arena_printf(
            arena, "about %.3g rays, at most %.3g are allowed (max_rays)",
            cost->rays, budget->rays);
    if (!within(cost->seconds, budget->seconds))
        return arena_printf(
            arena,
            "about %.3g s, at most %.3g s are allowed (max_render_seconds)",
            cost->seconds, budget->seconds);
    if (!within(cost->memory_bytes, budget->memory_bytes))
        return arena_printf(arena,
                            "about %.3g bytes of memory, at most %.3g are "
                            "allowed (max_render_bytes)",
                            cost->memory_bytes, budget->memory_bytes);
    return NULL;
}

enum http_verdict
budget_refuse(struct call *call, const struct order *order)
{
    struct budget budget = budget_of(&call->api->options, order);
    struct problem problem = {
        .kind = PROBLEM_BUDGET_EXCEEDED,
        .detail = sentence(&budget, call->request->arena),
        .errors = order->errors.count > 0 ? &order->errors : NULL,
        .more = write_budget,
        .user = &budget,
    };

    return call_show_problem(call, &problem);
}

bool
budget_check(struct call *call, const struct order *order)
{
    struct budget budget = budget_of(&call->api->options, order);

    if (!sentence(&budget, call->request->arena))
        return true;
    budget_refuse(call, order);
    return false;
}

void
budget_write_pixels(struct json_writer *w, const void *user)
{
    const struct order *order = user;
    const struct json *film = json_member(order->document.scene, "film");
    const struct json *width = film ? json_member(film, "width") : NULL;
    const struct json *height = film ? json_member(film, "height") : NULL;
    bool pixels = false;
    uint32_t fit_w, fit_h;
    double allowed;
    size_t i;

    for (i = 0; i < order->errors.count; i++)
        pixels = pixels || order->errors.items[i].code == ERROR_BUDGET_PIXELS;
    if (!pixels || !width || !height || width->type != JSON_NUMBER ||
        height->type != JSON_NUMBER || width->number < 1)
        return;
    allowed = or_default((double)order->max_pixels, max_pixels_default);
    json_begin_object(w, "requested");
    json_put_number(w, "pixels", width->number * height->number);
    json_end_object(w);
    json_begin_object(w, "allowed");
    json_put_number(w, "pixels", allowed);
    json_end_object(w);
    budget_fit_film(width->number, height->number, allowed, &fit_w, &fit_h);
    json_begin_array(w, "fits");
    write_film_fit(w, order, fit_w, fit_h);
    json_end_array(w);
}
