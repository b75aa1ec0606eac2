# Writes the software bill of materials of the program into its folder, as SPDX 2.3 in JSON
# (https://spdx.github.io/spdx-spec/v2.3): the program with its SHA-256,
# the libraries it is linked to, as Debian packages with their versions, and the compiler. Called after each link:
#   cmake -DPROGRAM=... -DVERSION=... -DOUTPUT=... -DSTATIC="PACKAGE;..." -DCOMPILER=/usr/bin/gcc -DSOURCE=FOLDER -P cli/sbom.cmake
# Packages come from ldd and dpkg; if these are missing, libraries are listed by their files and without a version. The
# time is SOURCE_DATE_EPOCH, or else that of
# the last commit, so that two builds of the same source write the same bytes.
cmake_minimum_required(VERSION 3.25)

function(output_of variable)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE text ERROR_QUIET RESULT_VARIABLE code OUTPUT_STRIP_TRAILING_WHITESPACE)
  set(${variable} "${text}" PARENT_SCOPE)
endfunction()

# --- linked libraries ---

set(ENV{LC_ALL} C)
output_of(listed ldd "${PROGRAM}")
output_of(dynamic readelf -d "${PROGRAM}")
string(REGEX MATCHALL "[^ \t\n]*/[^ \n]+ [(]0x" files "${listed}")
list(TRANSFORM files REPLACE " [(]0x$" "")
list(APPEND files ${COMPILER})

# Debian lists some libraries below /lib, others below /usr/lib
set(paths)
foreach(file ${files})
  file(REAL_PATH "${file}" real)
  string(REGEX REPLACE "^/usr" "" short "${real}")
  list(APPEND paths "${real}" "${short}")
endforeach()
output_of(owners dpkg-query -S ${paths})
string(REPLACE "\n" ";" owners "${owners}")
foreach(line ${owners})
  if(line MATCHES "^([^ :]+)(:[^ ]+)?: (/.+)$")
    set("package_${CMAKE_MATCH_3}" "${CMAKE_MATCH_1}")
  endif()
endforeach()

# Records a relation of `package`; the first one recorded is kept.
macro(relate package relation)
  if(NOT DEFINED "relation_${package}")
    set("relation_${package}" ${relation})
    list(APPEND packages "${package}")
  endif()
endmacro()

set(packages)
foreach(package ${STATIC})
  relate("${package}" STATIC_LINK)
endforeach()
foreach(pass DYNAMIC_LINK DEPENDS_ON)                  # DEPENDS_ON: of a library that another one needs
  foreach(file ${files})
    get_filename_component(soname "${file}" NAME)
    file(REAL_PATH "${file}" real)
    string(REGEX REPLACE "^/usr" "" short "${real}")
    set(package "${soname}")
    foreach(path "${real}" "${short}")
      if(DEFINED "package_${path}")
        set(package "${package_${path}}")
      endif()
    endforeach()
    string(FIND "${dynamic}" "[${soname}]" at)
    if(file STREQUAL COMPILER)
      relate("${package}" BUILD_TOOL_OF)
    elseif(pass STREQUAL DEPENDS_ON OR at GREATER -1)
      relate("${package}" ${pass})
    endif()
  endforeach()
endforeach()
list(SORT packages)
output_of(known dpkg-query -W "-f=\${Package}\t\${Version}\t\${Architecture}\t\${source:Package}\n" ${packages})
string(REPLACE "\n" ";" known "${known}")

# --- time ---

set(time "$ENV{SOURCE_DATE_EPOCH}")
if(NOT time)
  output_of(time git -C "${SOURCE}" log -1 --format=%ct)
endif()
if(time MATCHES "^[0-9]+$")
  set(ENV{SOURCE_DATE_EPOCH} ${time})
endif()
string(TIMESTAMP created "%Y-%m-%dT%H:%M:%SZ" UTC)

# --- the document ---

file(SHA256 "${PROGRAM}" digest)
string(SUBSTRING "${digest}" 0 32 short_digest)
set(entries)
set(relations "{\"spdxElementId\": \"SPDXRef-DOCUMENT\", \"relationshipType\": \"DESCRIBES\", \"relatedSpdxElement\": \"SPDXRef-seldinger\"}")
set(unknown "\"downloadLocation\": \"NOASSERTION\", \"filesAnalyzed\": false, \"licenseConcluded\": \"NOASSERTION\", \"licenseDeclared\": \"NOASSERTION\", \"copyrightText\": \"NOASSERTION\"")
foreach(package ${packages})
  string(REGEX REPLACE "[^A-Za-z0-9.-]" "-" id "SPDXRef-${package}")
  set(about)
  foreach(line ${known})
    string(REPLACE "\t" ";" field "${line}")
    list(GET field 0 owner)
    if(owner STREQUAL package)
      set(about ${field})
    endif()
  endforeach()
  if(about)
    list(GET about 1 version)
    list(GET about 2 architecture)
    list(GET about 3 source)
    string(REPLACE "+" "%2B" encoded "${version}")     # as the package URL specification requires
    string(REPLACE ":" "%3A" encoded "${encoded}")
    string(REPLACE "+" "%2B" encoded_name "${package}")
    string(CONCAT facts "\"versionInfo\": \"${version}\", \"supplier\": \"Organization: Debian\", \"sourceInfo\": \"built from ${source}\", "
      "\"externalRefs\": [{\"referenceCategory\": \"PACKAGE-MANAGER\", \"referenceType\": \"purl\", "
      "\"referenceLocator\": \"pkg:deb/debian/${encoded_name}@${encoded}?arch=${architecture}\"}], ")
  else()
    set(facts "")
  endif()
  string(APPEND entries ",\n    {\"SPDXID\": \"${id}\", \"name\": \"${package}\", ${facts}${unknown}}")
  set(pair "\"SPDXRef-seldinger\"" "\"${id}\"")
  if(relation_${package} STREQUAL BUILD_TOOL_OF)
    list(REVERSE pair)
  endif()
  list(GET pair 0 from)
  list(GET pair 1 to)
  string(APPEND relations ",\n    {\"spdxElementId\": ${from}, \"relationshipType\": \"${relation_${package}}\", \"relatedSpdxElement\": ${to}}")
endforeach()
file(WRITE "${OUTPUT}" "{
  \"spdxVersion\": \"SPDX-2.3\",
  \"dataLicense\": \"CC0-1.0\",
  \"SPDXID\": \"SPDXRef-DOCUMENT\",
  \"name\": \"seldinger-${VERSION}\",
  \"documentNamespace\": \"https://spdx.org/spdxdocs/seldinger-${VERSION}-${short_digest}\",
  \"creationInfo\": {\"created\": \"${created}\", \"creators\": [\"Organization: The Seldinger developers\", \"Tool: seldinger-sbom.cmake-${VERSION}\"]},
  \"packages\": [
    {\"SPDXID\": \"SPDXRef-seldinger\", \"name\": \"seldinger\", \"versionInfo\": \"${VERSION}\", \"primaryPackagePurpose\": \"APPLICATION\",
     \"supplier\": \"Organization: The Seldinger developers\", \"downloadLocation\": \"NOASSERTION\", \"filesAnalyzed\": false,
     \"checksums\": [{\"algorithm\": \"SHA256\", \"checksumValue\": \"${digest}\"}],
     \"licenseConcluded\": \"MIT\", \"licenseDeclared\": \"MIT\", \"copyrightText\": \"Copyright (c) 2026 The Seldinger developers\"}${entries}
  ],
  \"relationships\": [
    ${relations}
  ]
}
")
