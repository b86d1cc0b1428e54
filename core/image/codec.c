#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/image/image.h"
#include "core/image/module.h"

/* Guards the module's state; held only for looking and setting, never while
 * the module loads or works. */
static pthread_mutex_t module_lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t module_settled = PTHREAD_COND_INITIALIZER;
static enum { ABSENT, LOADING, LOADED, REFUSED } module_state;
static image_module_encode_fn module_encode;
static char module_error[256];

/* Where the module may lie, best first. A path that GLINT_IMAGE_MODULE names
 * is the only one tried. */
static bool
module_path(unsigned attempt, char path[PATH_MAX])
{
    const char *named = getenv("GLINT_IMAGE_MODULE");
    if (named != NULL && named[0] != '\0')
        return attempt == 0 && snprintf(path, PATH_MAX, "%s", named) < PATH_MAX;
    static const char *const places[] = {
        "/../lib/" IMAGE_MODULE_FILE,
        "/../lib/glint/" IMAGE_MODULE_FILE,
        "/" IMAGE_MODULE_FILE,
    };
    if (attempt >= sizeof places / sizeof places[0])
        return false;
    char folder[PATH_MAX];
    ssize_t len = readlink("/proc/self/exe", folder, sizeof folder - 1);
    if (len <= 0)
        return false;
    folder[len] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash == NULL)
        return false;
    *slash = '\0';
    size_t used = (size_t)(slash - folder);
    if (used + strlen(places[attempt]) >= PATH_MAX)
        return false;
    memcpy(path, folder, used);
    memcpy(path + used, places[attempt], strlen(places[attempt]) + 1);
    return true;
}

static image_module_encode_fn
module_open(char *why, size_t why_size)
{
    char path[PATH_MAX];
    snprintf(why, why_size, "%s was not found", IMAGE_MODULE_FILE);
    for (unsigned i = 0; module_path(i, path); i++) {
        if (getenv("GLINT_IMAGE_MODULE") == NULL && access(path, R_OK) != 0)
            continue;
        void *module = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
        void *symbol = module ? dlsym(module, IMAGE_MODULE_ENCODE) : NULL;
        if (symbol != NULL) {
            /* POSIX lets a dlsym result be a function; ISO C has no cast. */
            image_module_encode_fn encode;
            memcpy(&encode, &symbol, sizeof encode);
            return encode;
        }
        const char *said = dlerror();
        snprintf(why, why_size, "%s", said ? said : "no reason given");
        break;
    }
    return NULL;
}

static void *
load(void *nothing)
{
    char why[sizeof module_error] = "";
    image_module_encode_fn encode = module_open(why, sizeof why);
    pthread_mutex_lock(&module_lock);
    module_encode = encode;
    module_state = encode != NULL ? LOADED : REFUSED;
    memcpy(module_error, why, sizeof module_error);
    pthread_cond_broadcast(&module_settled);
    pthread_mutex_unlock(&module_lock);
    return nothing;
}

/* The library's many static constructors and lazy binding want more stack than
 * a thread that only waits; the default is enough. */
static bool
start_thread(void)
{
    pthread_attr_t attributes;
    pthread_t thread;
    if (pthread_attr_init(&attributes) != 0)
        return false;
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    bool started = pthread_create(&thread, &attributes, load, NULL) == 0;
    pthread_attr_destroy(&attributes);
    return started;
}

void
image_codec_load(void)
{
    pthread_mutex_lock(&module_lock);
    bool first = module_state == ABSENT;
    if (first)
        module_state = LOADING;
    pthread_mutex_unlock(&module_lock);
    if (first && !start_thread())
        load(NULL); /* no thread to be had: then here and now */
}

bool
image_codec_settled(void)
{
    pthread_mutex_lock(&module_lock);
    bool settled = module_state == LOADED || module_state == REFUSED;
    pthread_mutex_unlock(&module_lock);
    return settled;
}

/* The module's encode, once loaded. */
static image_module_encode_fn
wait_for_module(struct error *err)
{
    image_codec_load();
    pthread_mutex_lock(&module_lock);
    while (module_state == LOADING)
        pthread_cond_wait(&module_settled, &module_lock);
    image_module_encode_fn encode = module_encode;
    pthread_mutex_unlock(&module_lock);
    if (encode == NULL)
        error_set(err, ERROR_INTERNAL, "cannot load the image module: %s",
                  module_error);
    return encode;
}

/* Which samples a format can hold. */
static bool
image_check(const struct image *image, enum image_format format,
            struct error *err)
{
    bool whole = image->sample == IMAGE_UINT8 || image->sample == IMAGE_UINT16;
    if (image->width == 0 || image->height == 0 || image->data == NULL)
        return error_set(err, ERROR_INTERNAL,
                         "an image to encode must have pixels, got %u x %u",
                         image->width, image->height);
    if (image->channel_count == 0 || image->channel_count > IMAGE_CHANNEL_MAX)
        return error_set(err, ERROR_INTERNAL,
                         "an image must have 1 to %d channels, got %u",
                         IMAGE_CHANNEL_MAX, image->channel_count);
    if (format == IMAGE_PNG &&
        (!whole || image->channel_count > 4 || image->channel_count == 2))
        return error_set(err, ERROR_INTERNAL,
                         "a png must have 1, 3 or 4 channels of whole numbers");
    if (format == IMAGE_EXR && whole)
        return error_set(err, ERROR_INTERNAL,
                         "an exr must have samples of half or float");
    return true;
}

bool
image_encode(const struct image *image, enum image_format format,
             struct bytes *out, struct error *err)
{
    if (!image_check(image, format, err))
        return false;
    image_module_encode_fn encode = wait_for_module(err);
    return encode != NULL && encode(image, format, out, err);
}
