# cpack reads this before it makes a package: without these programs it would make one that depends on no library.
foreach(program dpkg-shlibdeps file)
  find_program(path_of_${program} ${program})
  if(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS AND NOT path_of_${program})
    message(FATAL_ERROR "${program}: not found, and needed for packages: apt-get install dpkg-dev file")
  endif()
endforeach()
