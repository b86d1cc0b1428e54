# Writes OUT, a C file in which each file of SOURCES (sql/NNN_name.sql) is a
# NUL-terminated array, and schema_steps lists them in order: step n brings a
# database from user_version n - 1 to n.
set(text "#include \"server/store/schema.h\"\n\n")
set(rows "")
foreach(source ${SOURCES})
    get_filename_component(name ${source} NAME_WE)
    file(READ ${source} hex HEX)
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
    string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n" bytes "${bytes}")
    string(APPEND text "static const char sql_${name}[] = {\n${bytes}0};\n\n")
    string(APPEND rows "    sql_${name},\n")
endforeach()
string(APPEND text "const char *const schema_steps[] = {\n${rows}};\n"
    "const int schema_version = (int)(sizeof schema_steps / sizeof schema_steps[0]);\n")
file(WRITE ${OUT} "${text}")
