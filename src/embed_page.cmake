# Writes OUTPUT, a C++ source with panelgate::web::SYMBOL(): FILES, packed by gzip, with a hash of each.
# With FOLDER instead of FILES: all that is in it, by their names below it. @PRELOAD@ in the dashboard's
# page stands for its modules, so that a browser asks for all of them at once.
cmake_minimum_required(VERSION 3.25)
get_filename_component(BESIDE ${OUTPUT} DIRECTORY)
if(FOLDER)
    file(GLOB_RECURSE FILES ${FOLDER}/*.*)
endif()
set(PRELOAD "")
foreach(FILE ${FILES})
    get_filename_component(NAME ${FILE} NAME)
    if(FILE MATCHES "/web/page/.*\\.js$")
        string(APPEND PRELOAD "<link rel=\"modulepreload\" href=\"page/${NAME}\">\n")
    endif()
endforeach()
set(TYPE_css "text/css; charset=utf-8")
set(TYPE_html "text/html; charset=utf-8")
set(TYPE_js "text/javascript; charset=utf-8")
set(TYPE_png "image/png")
set(TYPE_svg "image/svg+xml")

set(ARRAYS "")
set(ROWS "")
set(NUMBER 0)
foreach(FILE ${FILES})
    get_filename_component(NAME ${FILE} NAME)
    get_filename_component(ENDING ${FILE} LAST_EXT)
    string(SUBSTRING ${ENDING} 1 -1 ENDING)
    set(COPY ${FILE})
    if(FOLDER)
        file(RELATIVE_PATH NAME ${FOLDER} ${FILE})
    elseif(ENDING STREQUAL html)
        set(COPY ${BESIDE}/page_${NAME})
        file(READ ${FILE} TEXT)
        string(REPLACE "@PRELOAD@\n" "${PRELOAD}" TEXT "${TEXT}")
        file(WRITE ${COPY} "${TEXT}")
    endif()
    set(PACKED ${BESIDE}/${SYMBOL}.gz)
    execute_process(COMMAND gzip -9nc ${COPY} OUTPUT_FILE ${PACKED} COMMAND_ERROR_IS_FATAL ANY)
    file(SHA256 ${COPY} HASH)
    string(SUBSTRING ${HASH} 0 16 HASH)
    file(READ ${PACKED} BYTES HEX)
    string(REGEX REPLACE "(................................)" "\\1\n" BYTES "${BYTES}")
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," BYTES "${BYTES}")
    string(APPEND ARRAYS "constexpr unsigned char kFile${NUMBER}[] = {\n${BYTES}};\n")
    string(APPEND ROWS "    {\"${NAME}\", \"${TYPE_${ENDING}}\", \"${HASH}\", kFile${NUMBER}},\n")
    math(EXPR NUMBER "${NUMBER} + 1")
endforeach()
file(WRITE ${OUTPUT} "#include \"page.hpp\"

namespace panelgate::web {
namespace {
${ARRAYS}
constexpr PageFile kFiles[] = {
${ROWS}};
}  // namespace
std::span<const PageFile> ${SYMBOL}() { return kFiles; }
}  // namespace panelgate::web
")
