# The live service in a container. Its token, which every client sends (docs/service.md), is a secret named sila_token:
#   docker run -v sila:/var/lib/sila -v "$PWD/token:/run/secrets/sila_token:ro" -p 8765:8765 -p 8766:8766 sila
FROM debian:12 AS build
WORKDIR /sila
COPY . .
RUN tools/setup \
  && cmake --preset release -DSILA_BUILD_TESTS=OFF -DSILA_BUILD_BENCHMARKS=OFF \
  && cmake --build --preset release \
  && cpack --config build/release/CPackConfig.cmake -B /packages

FROM debian:12-slim
# The package brings the versions of its libraries that Debian 12 has.
# hadolint ignore=DL3008
RUN --mount=type=bind,from=build,source=/packages,target=/packages \
  apt-get update \
  && apt-get install --yes --no-install-recommends /packages/sila_*.deb \
  && rm -rf /var/lib/apt/lists/* \
  && useradd --system --uid 10001 --create-home --home-dir /var/lib/sila sila
USER 10001
WORKDIR /var/lib/sila
VOLUME /var/lib/sila
EXPOSE 8765 8766
HEALTHCHECK --interval=30s --timeout=3s CMD ["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/8765 && \
  printf 'GET /healthz?token=%s HTTP/1.0\\r\\n\\r\\n' \"$(head -n 1 /run/secrets/sila_token)\" >&3 && grep -q '^ok$' <&3"]
ENTRYPOINT ["sila"]
CMD ["serve", "--model", "corner.sila", "--http", "0.0.0.0:8765", "--tcp", "0.0.0.0:8766", "--token-file", "/run/secrets/sila_token"]
