# docker build -t uuv_marl . && docker run --rm -v "$PWD/results:/home/swarm/results" uuv_marl benchmark --seeds 2
FROM python:3.11-slim

RUN useradd --create-home swarm
WORKDIR /home/swarm
COPY --chown=swarm . uuv_marl
# PyTorch's own index has a build for processors alone, a tenth of the size.
RUN pip install --no-cache-dir -c uuv_marl/constraints.txt --extra-index-url https://download.pytorch.org/whl/cpu \
    './uuv_marl[analysis,render,train]'
USER swarm
RUN mkdir results
ENTRYPOINT ["uuv-marl"]
CMD ["--help"]
