# Writes OUT, a C file with version and build id: the SHA-256 over everything in
# core/ that can move a pixel, plus compiler and flags.
file(GLOB_RECURSE sources RELATIVE ${SOURCE_DIR} ${SOURCE_DIR}/core/*.c
     ${SOURCE_DIR}/core/*.h ${SOURCE_DIR}/core/*.cpp ${SOURCE_DIR}/core/*.txt)
list(SORT sources)
set(all "${FLAGS}")
foreach(source ${sources})
    file(SHA256 ${SOURCE_DIR}/${source} digest)
    string(APPEND all "${source} ${digest}\n")
endforeach()
string(SHA256 build "${all}")
set(text "#include \"core/base/isa.h\"\n\nconst char glint_version[] = \"${VERSION}\";\nconst char glint_build[] = \"${build}\";\n")
set(old "")
if(EXISTS ${OUT})
    file(READ ${OUT} old)
endif()
if(NOT old STREQUAL text)
    file(WRITE ${OUT} "${text}")
endif()
