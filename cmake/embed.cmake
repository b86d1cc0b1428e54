# Files into the program. embed_files(OUT FILES...) makes a C file with the
# table of server/api/files.h; it is written again when one of them changes.
#
#   include(cmake/embed.cmake)
#   embed_files(${CMAKE_CURRENT_BINARY_DIR}/files_data.c schemas/scene.json ...)
#
# As a script (cmake -DOUT= -DSOURCE_DIR= -DLIST= -P embed.cmake) it writes it.
if(CMAKE_SCRIPT_MODE_FILE)
    file(STRINGS ${LIST} names)
    list(SORT names COMPARE STRING CASE SENSITIVE)
    set(text "#include \"server/api/files.h\"\n\n")
    set(rows "")
    set(count 0)
    foreach(name ${names})
        file(READ ${SOURCE_DIR}/${name} hex HEX)
        file(SHA256 ${SOURCE_DIR}/${name} digest)
        file(SIZE ${SOURCE_DIR}/${name} size)
        string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
        # One more byte, so that an empty file is an array too and text ends.
        string(APPEND text "static const unsigned char data_${count}[] = {${bytes}0};\n")
        string(APPEND rows "    {\"${name}\", data_${count}, ${size}, \"${digest}\"},\n")
        math(EXPR count "${count} + 1")
    endforeach()
    string(APPEND text "\nconst struct file files[] = {\n${rows}};\nconst size_t file_count = ${count};\n")
    file(WRITE ${OUT} "${text}")
    return()
endif()

set(EMBED_SCRIPT ${CMAKE_CURRENT_LIST_FILE})
function(embed_files out)
    list(JOIN ARGN "\n" names)
    file(CONFIGURE OUTPUT ${out}.list CONTENT "${names}\n" @ONLY)
    list(TRANSFORM ARGN PREPEND ${CMAKE_SOURCE_DIR}/ OUTPUT_VARIABLE paths)
    add_custom_command(OUTPUT ${out}
        COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DSOURCE_DIR=${CMAKE_SOURCE_DIR}
                -DLIST=${out}.list -P ${EMBED_SCRIPT}
        DEPENDS ${paths} ${out}.list ${EMBED_SCRIPT}
        COMMENT "files for ${out}"
        VERBATIM)
endfunction()
