#include "tests/unit/image/read_back.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

template <size_t N> static void copy(char (&to)[N], const std::string &from)
{
    snprintf(to, N, "%s", from.c_str());
}

bool read_back(const char *format, const void *bytes, size_t len,
               struct picture *picture)
{
    *picture = {};
    OIIO::Filesystem::IOMemReader memory(const_cast<void *>(bytes), len);
    auto file = OIIO::ImageInput::create(format);
    OIIO::ImageSpec spec;
    if (!file || !file->set_ioproxy(&memory) ||
        !file->open(std::string("x.") + format, spec)) {
        fprintf(stderr, "not a readable %s\n", format);
        return false;
    }
    picture->width = spec.width;
    picture->height = spec.height;
    picture->channel_count = spec.nchannels;
    for (int i = 0; i < spec.nchannels && i < 32; i++)
        copy(picture->names[i], spec.channelnames[size_t(i)]);
    copy(picture->sample, spec.format.c_str());
    copy(picture->compression, spec.get_string_attribute("compression"));
    copy(picture->color_space, spec.get_string_attribute("oiio:ColorSpace"));
    copy(picture->date, spec.get_string_attribute("DateTime"));
    copy(picture->manifest, spec.get_string_attribute("glint:layers"));
    size_t count =
        size_t(spec.width) * size_t(spec.height) * size_t(spec.nchannels);
    picture->data = static_cast<float *>(calloc(count, sizeof(float)));
    picture->whole = static_cast<unsigned *>(calloc(count, sizeof(unsigned)));
    if (spec.format != OIIO::TypeDesc::UINT8 &&
        spec.format != OIIO::TypeDesc::UINT16)
        return file->read_image(0, 0, 0, -1, OIIO::TypeDesc::FLOAT,
                                picture->data);
    // Samples as stored, widened by us and not by the library.
    bool narrow = spec.format == OIIO::TypeDesc::UINT8;
    std::string raw(count * 2, '\0');
    bool ok = file->read_image(0, 0, 0, -1, spec.format, &raw[0]);
    for (size_t i = 0; i < count; i++) {
        unsigned short wide = 0;
        if (!narrow)
            memcpy(&wide, &raw[i * 2], 2);
        picture->whole[i] = narrow ? static_cast<unsigned char>(raw[i]) : wide;
    }
    return ok;
}

void picture_clear(struct picture *picture)
{
    free(picture->data);
    free(picture->whole);
    *picture = {};
}

int picture_channel(const struct picture *picture, const char *name)
{
    for (int i = 0; i < picture->channel_count; i++)
        if (strcmp(picture->names[i], name) == 0)
            return i;
    return -1;
}
