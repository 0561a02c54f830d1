# Writes files as C++ strings: cmake -D FOLDER=.. -D FILES=a,b -D OUTPUT=x.cc -P embed.cmake
string(REPLACE "," ";" files "${FILES}")
set(entries "")
foreach(file IN LISTS files)
  file(READ ${FOLDER}/${file} bytes HEX)
  file(SHA256 ${FOLDER}/${file} hash)
  string(SUBSTRING ${hash} 0 16 hash)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "\\\\x\\1" text "${bytes}")
  string(LENGTH "${text}" length)
  set(lines "    \"\"\n")
  set(place 0)
  while(place LESS length)
    string(SUBSTRING "${text}" ${place} 4096 line)
    string(APPEND lines "    \"${line}\"\n")
    math(EXPR place "${place} + 4096")
  endwhile()
  string(APPEND entries "      {\"${file}\", \"${hash}\", std::string_view(\n${lines}    , ${length} / 4)},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"learner/web/page_files.h\"

namespace treeroll::web {

std::span<const PageFile> page_files() {
  static constexpr PageFile kFiles[] = {
${entries}  };
  return kFiles;
}

}  // namespace treeroll::web
")
