package flyframe.server

import org.bouncycastle.crypto.engines.AsconAEAD128
import org.bouncycastle.crypto.params.{AEADParameters, KeyParameter}
import flyframe.protocol.ServerDatagram

/** Tags by Ascon-AEAD128 (NIST SP 800-232): the message is associated data, and there is no plaintext. */
object AsconTag {

  /** The tag, 16 bytes.
    *
    * @param key
    *   16 bytes
    * @param nonce
    *   16 bytes, never the same twice with a key
    */
  def apply(key: Array[Byte], nonce: Array[Byte], message: Array[Byte]): Array[Byte] = {
    val engine = new AsconAEAD128
    engine.init(true, new AEADParameters(new KeyParameter(key), 8 * ServerDatagram.TagBytes, nonce))
    engine.processAADBytes(message, 0, message.length)
    val tag = new Array[Byte](ServerDatagram.TagBytes)
    engine.doFinal(tag, 0)
    tag
  }
}
