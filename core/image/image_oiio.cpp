// image_oiio.cpp - image -> PNG or EXR bytes, in memory. The only file that
// knows OpenImageIO, and the only C++; built as the module glint-image.so, which
// codec.c loads. Its one symbol is glint_image_encode.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <new>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/image/module.h"

namespace
{

// Measured on the table scene: docs/performance.md, "PNG level".
constexpr int png_level = 4;
// libpng's PNG_FILTER_SUB, the difference to the left neighbour: the smallest
// files at every level, and near the quickest.
constexpr int png_filter = 0x10;

// Before the first file: no threads but ours, so the same picture costs the
// same, and a sandbox need not let the library start any.
void
settle()
{
    static const bool once = [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", -1);
        return true;
    }();
    (void)once;
}

struct kind {
    const char *format;
    OIIO::TypeDesc sample;
};

kind
kind_of(const struct image *image, enum image_format format)
{
    const char *name = format == IMAGE_PNG ? "png" : "exr";
    switch (image->sample) {
    case IMAGE_UINT8: return {name, OIIO::TypeDesc::UINT8};
    case IMAGE_UINT16: return {name, OIIO::TypeDesc::UINT16};
    case IMAGE_HALF: return {name, OIIO::TypeDesc::HALF};
    case IMAGE_FLOAT: break;
    }
    return {name, OIIO::TypeDesc::FLOAT};
}

// Everything that ends up in the header is said here; what is not said, the
// library would take from the clock (DateTime) or from its own version.
OIIO::ImageSpec
spec_of(const struct image *image, enum image_format format,
        OIIO::TypeDesc sample)
{
    OIIO::ImageSpec spec(int(image->width), int(image->height),
                         int(image->channel_count), sample);
    spec.channelnames.clear();
    for (uint32_t i = 0; i < image->channel_count; i++)
        spec.channelnames.emplace_back(image->names[i]);
    spec.alpha_channel = -1;
    spec.z_channel = -1;
    if (format == IMAGE_PNG) {
        spec.attribute("png:compressionLevel", png_level);
        spec.attribute("png:filter", png_filter);
        // Without it the file says nothing, and viewers show numbers as they
        // are: that is what `linear` asks for.
        if (image->srgb)
            spec.attribute("oiio:ColorSpace", "sRGB");
    } else {
        spec.attribute("compression", "zip");
        spec.attribute("oiio:ColorSpace", "Linear");
        spec.attribute("DateTime", "2000:01:01 00:00:00");
        spec.attribute("Software", "glint");
        if (image->manifest[0] != '\0')
            spec.attribute("glint:layers", image->manifest);
    }
    return spec;
}

// Whole numbers 0...255 or 0...65535 as develop left them: no rounding here.
template <typename T>
std::vector<T>
narrow(const struct image *image)
{
    size_t count = size_t(image->width) * image->height * image->channel_count;
    std::vector<T> samples(count);
    for (size_t i = 0; i < count; i++)
        samples[i] = T(image->data[i]);
    return samples;
}

bool
write_samples(OIIO::ImageOutput &file, const struct image *image)
{
    switch (image->sample) {
    case IMAGE_UINT8:
        return file.write_image(OIIO::TypeDesc::UINT8,
                                narrow<uint8_t>(image).data());
    case IMAGE_UINT16:
        return file.write_image(OIIO::TypeDesc::UINT16,
                                narrow<uint16_t>(image).data());
    default: return file.write_image(OIIO::TypeDesc::FLOAT, image->data);
    }
}

bool
encode(const struct image *image, enum image_format format, struct bytes *out,
       struct error *err)
{
    settle();
    kind k = kind_of(image, format);
    std::unique_ptr<OIIO::ImageOutput> file =
        OIIO::ImageOutput::create(k.format);
    if (!file)
        return error_set(err, ERROR_INTERNAL, "cannot encode %s: %s", k.format,
                         OIIO::geterror().c_str());
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    OIIO::ImageSpec spec = spec_of(image, format, k.sample);
    std::string name = std::string("glint.") + k.format;
    if (!file->set_ioproxy(&memory) || !file->open(name, spec) ||
        !write_samples(*file, image) || !file->close())
        return error_set(err, ERROR_INTERNAL, "cannot encode %s: %s", k.format,
                         file->geterror().c_str());
    bytes_append(out, bytes.data(), bytes.size());
    if (out->failed)
        return error_set(err, ERROR_MEMORY, "no memory for %zu bytes of %s",
                         bytes.size(), k.format);
    return true;
}

} // namespace

// No exception may cross into C.
extern "C" __attribute__((visibility("default"))) bool
glint_image_encode(const struct image *image, enum image_format format,
                   struct bytes *out, struct error *err)
{
    try {
        return encode(image, format, out, err);
    } catch (const std::bad_alloc &) {
        return error_set(err, ERROR_MEMORY, "no memory to encode the image");
    } catch (const std::exception &e) {
        return error_set(err, ERROR_INTERNAL, "cannot encode the image: %s",
                         e.what());
    } catch (...) {
        return error_set(err, ERROR_INTERNAL, "cannot encode the image");
    }
}
