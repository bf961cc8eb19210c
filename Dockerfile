# gdfmap on Debian 12:
#
#   docker build -t gdfmap .
#   docker run --rm -v "$PWD:/data" gdfmap info scan.ply
#
# What it is built with stands in tools/dependencies.sh alone, and what it runs with follows from the
# program itself: the packages of the libraries that it loads, and a font for pictures.
FROM debian:12 AS build
WORKDIR /gdfmap
COPY tools/dependencies.sh tools/
RUN tools/dependencies.sh
COPY . .
RUN cmake --preset release -D GDFMAP_TESTS=OFF -D GDFMAP_BENCHMARKS=OFF \
 && cmake --build --preset release \
 && cmake --install build/release --prefix /usr/local
RUN ldd /usr/local/bin/gdfmap | awk '/=> \//{print $3}' | xargs realpath | xargs dpkg -S 2>/dev/null \
  | cut -d: -f1 | sort -u > /packages && echo fonts-dejavu-core >> /packages

FROM debian:12
COPY --from=build /packages /packages
RUN apt-get update \
 && xargs apt-get install -y --no-install-recommends < /packages \
 && rm -rf /var/lib/apt/lists/*
COPY --from=build /usr/local/bin/gdfmap /usr/local/bin/
WORKDIR /data
ENTRYPOINT ["gdfmap"]
